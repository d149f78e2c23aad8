"""Profile files: those that pages have sent, in a folder that goes with the program, for benches may share them."""

import os
import shutil
from pathlib import Path

from machine.pipeline.requests import Given
from machine.workbench.bench.settings import named
from machine.workbench.session.session import Session
from machine.workbench.work.received import Received, remove_file
from profiles.errors import ProfileError
from profiles.places import KINDS, kind_in


class ProfileFiles:
    """A folder of them."""

    def __init__(self) -> None:
        self._received = Received()

    def take(self, path: Path, session: Session) -> bool:
        """Whether a file that a page has sent is a profile, which is then taken in place of the bench's machine, material or
        process. Raises ProfileError for one that is not valid."""
        try:
            kind = kind_in(path)
        except ProfileError:
            return False
        copy = str(shutil.copy(path, self._received.new_file(path.name)))
        try:
            session.start(session.take_given(f"take {path.name}", lambda given: named(given, kind, copy)))
        except ProfileError as error:
            remove_file(Path(copy))
            raise ProfileError(str(error).replace(f"{Path(copy).parent}{os.sep}", "")) from None
        return True

    def copied(self, given: Given, own_names: dict[str, str]) -> Given:
        """The same with copies of the profiles that are files, which have these names. Raises OSError."""
        for kind, name in own_names.items():
            given = named(given, kind, str(shutil.copy(getattr(given, kind), self._received.new_file(name))))
        return given

    def as_shown(self, given: Given) -> Given:
        """Names and settings for a person, who knows of a file that was sent by its own name alone."""
        for kind in KINDS:
            file = Path(getattr(given, kind))
            if file.parent.parent == self._received.path:
                given = named(given, kind, file.name)
        return given
