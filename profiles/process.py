"""The process: settings for slicing and printing a part."""

from collections.abc import Iterable

from profiles.settings.layers import Finish, Infill, Layers, Shell
from profiles.settings.motion import Motion
from profiles.settings.support import FARTHEST_MM, Interface, Plate, Support

HEIGHTS = ("layer_height_mm", "first_layer_height_mm")
WIDTHS = (
    "line_width_mm",
    "first_layer_line_width_mm",
    "interface_line_width_mm",
    "outer_wall_line_width_mm",
    "top_skin_line_width_mm",
    "infill_line_width_mm",
    "support_line_width_mm",
)

MOST_SHARE = 0.9  # share of a line's width: a higher bead does not stick
ROUGHEST = 2.0  # line widths by which a fuzzy wall may be moved


class Process(Motion, Interface, Plate, Support, Infill, Finish, Shell, Layers):
    """Slicing and printing settings: those of all its bases, the last one's first."""

    @property
    def heights(self) -> tuple[str, ...]:
        """The keys of all layer heights."""
        return (*HEIGHTS, *(("least_layer_height_mm", "most_layer_height_mm") if self.adaptive_cusp_mm > 0 else ()))

    @property
    def highest_layer_mm(self) -> float:
        """The highest layer that all line widths except the first layer's allow."""
        widths: list[float | None] = [getattr(self, key) for key in WIDTHS if key != "first_layer_line_width_mm"]
        return MOST_SHARE * min(width for width in widths if width is not None)

    def _problems(self) -> Iterable[str]:
        if max(map(abs, self.place_mm)) > FARTHEST_MM:
            yield f"place_mm is {list(self.place_mm)}: each must lie between {-FARTHEST_MM:g} and {FARTHEST_MM:g} mm"
        for wide, width in ((wide, getattr(self, wide)) for wide in WIDTHS):
            first = wide == "first_layer_line_width_mm"
            for key in ("first_layer_height_mm",) if first else self.heights:
                if width is not None and getattr(self, key) > MOST_SHARE * width:
                    allowed = f"at most {MOST_SHARE:g} of {wide} ({MOST_SHARE * width:g} mm) is allowed"
                    yield f"{key} is {getattr(self, key):g} mm: {allowed}"
        deepest_mm = max(self.line_width_mm - self.layer_height_mm, 0.0)
        if self.interlock == "grooves" and self.interlock_mm > deepest_mm + 1e-9:
            yield (
                f"interlock_mm is {self.interlock_mm:g} mm: at most line_width_mm less layer_height_mm "
                f"({deepest_mm:g} mm) is filled by one bead"
            )
        if self.interlock == "grooves" and self.interlock_mm == 0.0:
            yield "interlock_mm is 0 mm: interlock = grooves makes grooves deeper than that"
        if self.adaptive_cusp_mm > 0 and self.least_layer_height_mm > self.most_layer_height_mm:
            yield (
                f"least_layer_height_mm is {self.least_layer_height_mm:g} mm: at most most_layer_height_mm "
                f"({self.most_layer_height_mm:g} mm) is allowed"
            )
        if self.infill_pattern == "lightning" and self.walls == 0 and 0.0 < self.infill_density < 1.0:
            yield "walls is 0: infill_pattern = lightning grows out of the walls and needs at least 1"
        roughest_mm = ROUGHEST * self.line_width_mm
        if self.fuzzy_skin != "none" and self.fuzzy_skin_thickness_mm > roughest_mm + 1e-9:
            yield (
                f"fuzzy_skin_thickness_mm is {self.fuzzy_skin_thickness_mm:g} mm: at most {ROUGHEST:g} times line_width_mm "
                f"({roughest_mm:g} mm) is allowed, or walls would miss the layer below"
            )
