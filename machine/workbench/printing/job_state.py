"""Job state: a print as its process reports it and pages show it, and the loading of a bench's slices."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from machine.dryrun.dryrun import dry_run
from machine.dryrun.findings import KnownFindings
from machine.link.print_state import PrintState, PrintStatus
from machine.notices import Notice
from machine.pipeline import compilers
from machine.pipeline.programs import LoadedProgram
from machine.printing.destination import Server
from machine.printing.job import Does, PrintJob
from machine.program import Program
from profiles.errors import PlanError
from profiles.profile import Profile


@dataclass(frozen=True)
class JobState:
    """A print as pages see it. resumes: the journal of the print whose rest it is; key: of the slices; starts: False where a
    print server only gets the file; server: whether a print server prints it.

    question: what a person is asked before it begins; log, journal: files; webcam: where its picture is; sentence: how it ended;
    checks: what was found before, forced where it speaks against the print; words: what the printer has said; said: what the
    program has; figures: of the program; progress: the newest moment, told_s: when it was, seconds since 1970; forcible: force
    goes past why it was refused; stop_given: an emergency stop was heard.
    """

    state: PrintState = PrintState.CHECKING
    name: str = ""
    machine: str = ""
    port: str = ""
    resumes: str = ""
    key: str = ""
    starts: bool = True
    server: bool = False
    question: str = ""
    log: str = ""
    journal: str = ""
    webcam: str = ""
    sentence: str = ""
    checks: tuple[Notice, ...] = ()
    words: tuple[str, ...] = ()
    said: tuple[str, ...] = ()
    figures: dict[str, Any] | None = None
    progress: PrintStatus | None = None
    told_s: float = 0.0
    forcible: bool = False
    stop_given: bool = False

    def json(self) -> dict[str, Any]:
        """The state for a page. over: whether nothing of it goes on; heat_s: since when the temperatures are known, seconds since
        1970, for the page goes on counting when nothing more comes."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        checks = [{"text": check.text, "forced": check.forced} for check in self.checks]
        progress = self.progress and self.progress.json() | {"heat_s": self.told_s - self.progress.heat_age_s}
        return values | {"checks": checks, "progress": progress, "over": self.state.is_over}


def first_state(job: PrintJob) -> JobState:
    """The state of a print before its process has reported anything."""
    name = job.name or {Does.HAND: "by hand", Does.FOLLOW: "what it prints"}.get(job.does, "")
    return JobState(
        name=name if job.cut_off is None else job.cut_off.stem,
        machine=job.profile.machine.name if job.does is Does.PRINT and job.profile is not None else "",
        port=job.destination.name,
        resumes=str(job.cut_off or ""),
        key=job.key,
        starts=job.starts,
        server=isinstance(job.destination, Server),
    )


@dataclass(frozen=True, eq=False)
class Slices:
    """A bench's slices, called to load them. gcode: a file as `export` writes it; known: what a dry run has found of it."""

    name: str
    gcode: Path
    profile: Profile
    known: KnownFindings | None = None

    def __call__(self) -> LoadedProgram:
        """These very lines, dry-run; what the dry run of the very same has found for the very same profile is not looked for
        again. Raises PlanError where they are not there any more."""
        try:
            text = self.gcode.read_bytes().decode()
        except FileNotFoundError:
            raise PlanError("these slices are not there any more: slice what is to be printed again") from None
        compilers.wait_for(compilers.DRY_RUN)
        lines = tuple(text.removesuffix("\n").split("\n"))
        findings = None if self.known is None else self.known.of(lines, self.profile)
        return LoadedProgram(self.name, Program(lines, dry_run(lines, self.profile, findings), None), self.profile)
