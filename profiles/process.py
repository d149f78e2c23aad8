"""The process: how a part is sliced and printed."""

from typing import Self

from pydantic import model_validator

from profiles.settings.finish import Finish
from profiles.settings.infill import Infill
from profiles.settings.interface import Interface
from profiles.settings.layers import Layers
from profiles.settings.motion import Motion
from profiles.settings.plate import Plate
from profiles.settings.shell import Shell
from profiles.settings.support import Support

HEIGHTS = ("layer_height_mm", "first_layer_height_mm")
WIDTHS = (
    "line_width_mm",
    "first_layer_line_width_mm",
    "outer_wall_line_width_mm",
    "top_skin_line_width_mm",
    "infill_line_width_mm",
    "support_line_width_mm",
)


class Process(Motion, Interface, Plate, Support, Infill, Finish, Shell, Layers):
    """Slicing and printing settings: those of all its bases, the last one's first."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        adaptive = ("least_layer_height_mm", "most_layer_height_mm") if self.adaptive_cusp_mm > 0 else ()
        for wide, width in ((wide, getattr(self, wide)) for wide in WIDTHS):
            first = wide == "first_layer_line_width_mm"
            for key in ("first_layer_height_mm",) if first else (*HEIGHTS, *adaptive):
                if width is not None and getattr(self, key) > 0.9 * width:
                    raise ValueError(f"{key} is {getattr(self, key):g} mm: at most 0.9 of {wide} ({0.9 * width:g} mm) is allowed")
        if self.interlock_mm > self.line_width_mm - self.layer_height_mm + 1e-9:
            raise ValueError(
                f"interlock_mm is {self.interlock_mm:g} mm: at most line_width_mm less layer_height_mm "
                f"({self.line_width_mm - self.layer_height_mm:g} mm) is filled by one bead"
            )
        if adaptive and self.least_layer_height_mm > self.most_layer_height_mm:
            raise ValueError(
                f"least_layer_height_mm is {self.least_layer_height_mm:g} mm: at most most_layer_height_mm "
                f"({self.most_layer_height_mm:g} mm) is allowed"
            )
        return self
