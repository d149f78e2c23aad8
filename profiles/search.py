"""The search: settings for finding the parts of a model; a table of a process profile."""

from functools import cache
from importlib import resources
from typing import Any, Literal

from profiles.frozen import Frozen, advanced, rare, simple
from profiles.toml_text import read_toml


@cache
def _mode(name: str) -> dict[str, Any]:
    """The settings of a mode of the search, with those of the mode it inherits."""
    file = resources.files("profiles") / "searches" / f"{name}.toml"
    document = read_toml(file.read_text(encoding="utf-8"))
    below = _mode(document["inherits"]) if "inherits" in document else {}
    return {**below, **document["search"]}


class Search(Frozen):
    """How the parts are searched."""

    directions: int = advanced("Directions tried", "orientations samples", ge=1, le=100000)(
        600, "directions spread over the sphere above the least angle"
    )
    least_elevation_deg: float = rare("Least angle of a direction", ge=0, le=89)(
        10.0, "least angle of a direction above the build plate, deg"
    )
    offset_step_mm: float = advanced("Distance of the planes tried", "step samples", gt=0, le=100)(
        1.0, "distance of sampled planes, mm"
    )
    method: Literal["best", "published"] = rare("Method")(
        "best", "published: the authors' stop rule and bookkeeping, for comparisons; best: ours"
    )
    beam_width: int = advanced("Beam width", "thoroughness search effort", ge=1, le=1000)(4, "decompositions followed at a time")
    objective: Literal["scar", "risky"] = rare("Objective")(
        "scar",
        "scar minimises support, seams, cuts, stair-stepping and bores, risky the area that needs support alone, as published",
    )
    seam_mm: float = advanced("Width of a seam's blemish", "seam weight", ge=0, le=100)(
        5.0,
        "width of a cut seam's blemish on a model of 100 mm, mm; in proportion on others: a cut must make more surface safe "
        "than its rim takes; 0: the paper's objective",
    )
    feather_weight: float = rare("Weight of thin edges", "feather sharp", ge=0, le=100)(
        0.5,
        "extra weight of a seam at edges below 30 deg; it is multiplied by cot angle - cot 30: such edges are thin, warp and "
        "break",
    )
    cut_mm2: float = advanced("Cost of a cut", "fewer parts penalty", ge=0, le=10000)(
        10.0,
        "cost of a cut besides its seam: one more turn, one more joint that can fail, mm²; a cut that saves less than its "
        "seam and this is not made",
    )
    stair_weight: float = advanced("Weight of stair-stepping", "staircase layer lines stepping quality", ge=0, le=10)(
        0.1,
        "weight of stair-stepping as high as a 0.2 mm layer (support: 1); less where the layers or the angle make the steps "
        "lower: walls and level faces have none, so parts are printed along their faces; 0: stair-stepping does not count",
    )
    second_mm2: float = advanced("Cost of a second", "print time penalty", ge=0, le=1000)(
        0.1,
        "cost of a second of printing in the final choice: so much surface that a seam or support blemishes, mm² (1 cm² is "
        "worth 1000 s); 0: time is free, as it is without support",
    )
    metre_mm2: float = advanced("Cost of a metre of filament", "plastic waste penalty", ge=0, le=1e5)(
        100.0,
        "cost of a metre of filament in the final choice, mm² (as 1000 s do: support has to be removed again); 0: it is free, "
        "as it is without support",
    )
    hidden_seam_share: float = rare("Weight of hidden seams", gt=0, le=1)(
        0.25,
        "weight of a seam in a crease, in a neck or out of sight; 1: as in plain sight; 100 %: the same everywhere",
    )
    feature_weight: float = rare("Weight of seams across bores", "holes", ge=1, le=1000)(
        4.0, "weight of a seam across a bore; 1: as elsewhere"
    )
    feature_mm2: float = rare("Cost of an oblique cut through a bore", "holes", ge=0, le=1e5)(
        500.0,
        "cost of a cut askew through a bore, besides its seam, mm²; one across its axis leaves it round and costs nothing",
    )
    unsupportable_weight: float = rare("Overhangs with nothing below count", "supports", ge=1, le=1000)(
        5.0,
        "weight of an overhang with only air beneath it along the part's direction: support leans there from the side or "
        "stands on support printed with other parts, which takes more plastic and holds less well",
    )
    least_saving: float = advanced("Every further part saves at least", "minimum share gain", ge=0, le=1)(
        0.03,
        "share of one piece's cost that every further part must save; the cost includes time and filament; where more parts "
        "would save less, a note says so, and --parts N takes them",
    )
    polish: bool = rare("Polish the best results")(
        True, "improve the best results of a beam of two or more: remove, move and add cuts"
    )
    least_volume_share: float = advanced("Smallest part", "minimum volume", ge=0, lt=1)(
        0.02, "least share of the model's volume in a part, criterion IV (published: 10 %)"
    )
    preferred_volume_share: float = rare("Smallest part that is preferred", "minimum volume", ge=0, lt=1)(
        0.1, "share of the volume from which the classic ranking takes parts first; smaller ones are allowed"
    )
    least_interface_mm2: float = advanced("Smallest face a part stands on", "minimum area", ge=0, le=1e6)(
        4.0, "least area under a part and its pieces, mm²; fragments are not counted"
    )
    nozzle_load_n: float = rare("Push of the nozzle", "strength force", ge=0, le=1000)(
        5.0,
        "sideways push of the nozzle at a part's top, N; its base must bear it; 0: strength is ignored",
    )
    strength_safety: float = rare("Safety of a joint", "strength factor", ge=1, le=100)(
        1.0,
        "safety factor of a joint under that push: its strength is material.interlayer_strength_mpa times "
        "material.cold_weld_factor",
    )
    fragile_mm: float = rare("Thinnest sliver", ge=0, le=100)(
        0.3, "thinnest sliver that a plane may leave, mm; about a layer and a half"
    )
    pedestal_mm: float = simple("Pedestal height", "raft base lift", ge=0, le=1000)(
        0.0, "height of a pedestal that makes low, strongly tilted cuts printable, mm"
    )
    simplify_faces: int = rare("Simplify models of more faces than", "reduce triangles decimate", ge=0)(
        20000,
        "models of more faces are searched on a copy; it lies within 1.5 layers of the model, which the planes then cut; 0: "
        "never",
    )
    most_parts: int = simple("Most parts", "maximum number count", ge=1, le=1000)(12, "greatest number of parts")
    time_limit_s: float | None = advanced("Time for the search", "limit", ge=0)(
        None, "time limit of the search, s; it ends with the best result so far"
    )
    least_gain: float = rare("Least share a cut makes safe", ge=0, le=1)(
        0.002, "least share of the risky area that a cut makes safe; faces on the build plate are not counted"
    )
    least_gain_preferred: float = rare("Least share a preferred cut makes safe", ge=0, le=1)(
        1e-4, "least_gain for parts of the preferred volume (classic ranking; published: 0.01 %)"
    )
    platform_radius_mm: float | None = rare("Radius that planes must clear", gt=0)(
        None, "radius of the disc that planes must clear (criterion III); absent: the model's footprint"
    )
    count_platform_faces: bool = rare("Count faces on the build plate")(
        False, "true: faces standing on the build plate count as risky (the authors' terms)"
    )
    single_limb: bool = simple("Cut off single limbs", "branch arm leg tree one at a time")(
        True,
        "a cut may take single limbs; others stay beside the part where the head passes them clear; false: it takes all that "
        "lies above its plane",
    )
    clearance: bool = rare("Respect head and axis limits", "collision")(
        True, "false: the head's bodies and the axis limits are ignored (the authors' terms)"
    )

    @property
    def effective(self) -> "Search":
        """The settings in effect: the published search uses the paper's terms, and settings without effect are 0 or off.

        >>> Search(objective="risky").effective.cut_mm2
        0.0
        """
        if self.method == "published":
            return self.model_copy(update=_mode("published"))
        if self.objective == "risky":
            return self.model_copy(update=_mode("risky"))
        return self.model_copy(update=_mode("seamless")) if self.seam_mm == 0.0 else self
