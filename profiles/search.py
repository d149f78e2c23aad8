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
        600, "directions sampled on the Gaussian sphere"
    )
    least_elevation_deg: float = rare("Least angle of a direction", ge=0, le=89)(
        10.0, "least angle of a direction above the build plate, deg"
    )
    offset_step_mm: float = advanced("Distance of the planes tried", "step samples", gt=0, le=100)(
        1.0, "distance of the sampled planes of a direction, mm"
    )
    method: Literal["best", "published"] = rare("Method")(
        "best", "published: the authors' stop rule and bookkeeping, for comparisons; best: ours"
    )
    beam_width: int = advanced("Beam width", "thoroughness search effort", ge=1, le=1000)(
        4, "how many decompositions are followed at a time"
    )
    objective: Literal["scar", "risky"] = rare("What is made small")(
        "scar",
        "scar: area that needs support and the seams of the cuts, each as wide as its scar; risky: the area alone, the terms of "
        "the 2020 paper",
    )
    seam_mm: float = advanced("Width of a cut's scar", "seam weight", ge=0, le=100)(
        5.0,
        "width of the scar that a seam leaves on a model of 100 mm from end to end, in proportion on others, mm: a cut must make "
        "more surface safe than its rim takes; 0: the paper's objective",
    )
    feather_weight: float = rare("Thin edges count", "feather sharp", ge=0, le=100)(
        0.5,
        "by how much more a seam counts where face and plane meet at less than 30 deg, times cot angle - cot 30: such edges are "
        "thin, warp and break",
    )
    cut_mm2: float = advanced("What a cut costs", "fewer parts penalty", ge=0, le=10000)(
        10.0,
        "what a cut costs beside its seam: one more turn, one more joint that can fail, mm²; a cut that saves less than its seam "
        "and this is not made",
    )
    stair_weight: float = advanced("Stairs count", "staircase layer lines stepping quality", ge=0, le=10)(
        0.1,
        "weight of an area with stair-stepping as high as a layer of 0.2 mm, compared with 1 where support blemishes it; less "
        "where the layers or the angle make the steps lower: walls and level faces have none, so parts are printed along their "
        "faces; 0: stair-stepping does not count",
    )
    second_mm2: float = advanced("What a second costs", "print time penalty", ge=0, le=1000)(
        0.1,
        "what a second of printing counts in the choice between numbers of parts and orientations: so much surface that a seam "
        "or support blemishes, mm² (1 cm² is worth 1000 s); 0: time is free, as it is without support",
    )
    metre_mm2: float = advanced("What a metre of filament costs", "plastic waste penalty", ge=0, le=1e5)(
        100.0,
        "what a metre of filament counts there, mm² (as 1000 s do: support has to be removed again); 0: it is free, as it is "
        "without support",
    )
    hidden_seam_share: float = rare("Hidden cuts count", gt=0, le=1)(
        0.25,
        "how much a seam counts deep in a crease or neck or out of sight, as a share of what it counts across a smooth surface "
        "in plain sight; 100 %: the same everywhere",
    )
    feature_weight: float = rare("Cuts across bores count", "holes", ge=1, le=1000)(
        4.0, "how many times a seam counts across a bore, where a ridge spoils a fit; 1: as elsewhere"
    )
    feature_mm2: float = rare("What a cut askew through a bore costs", "holes", ge=0, le=1e5)(
        500.0,
        "what it costs beside its seam that a cut passes askew through a bore, which then holds and guides nothing, mm²; one "
        "across its axis leaves it round and costs nothing",
    )
    unsupportable_weight: float = rare("Overhangs with nothing below count", "supports", ge=1, le=1000)(
        5.0,
        "how many times an area counts that needs support and has nothing but air beneath it along its part's direction: support "
        "leans there from the side or stands on support printed with other parts, which takes more plastic and holds less well",
    )
    least_saving: float = advanced("Every further part saves at least", "minimum share gain", ge=0, le=1)(
        0.03,
        "share of what one piece costs, with its time and filament, that every further part must save; where more parts would "
        "save less, a note says so, and --parts N takes them",
    )
    polish: bool = rare("Polish the best results")(
        True, "the best results of a beam of two or more are shortened, their planes moved off the grid and cuts added"
    )
    least_volume_share: float = advanced("Smallest part", "minimum volume", ge=0, lt=1)(
        0.02, "criterion IV: a part has at least this share of the model's volume (published: 10 %)"
    )
    preferred_volume_share: float = rare("Smallest part that is preferred", "minimum volume", ge=0, lt=1)(
        0.1, "criterion IV as a preference: the classic ranking takes parts of at least this share of the volume first"
    )
    least_interface_mm2: float = advanced("Smallest face a part stands on", "minimum area", ge=0, le=1e6)(
        4.0, "least area that a part, and each of its pieces that is no fragment, stands on, mm²"
    )
    nozzle_load_n: float = rare("Push of the nozzle", "strength force", ge=0, le=1000)(
        5.0,
        "push of the nozzle against the top of a part, sideways, that its base must bear while it is printed, N; 0: strength is "
        "ignored",
    )
    strength_safety: float = rare("Safety of a joint", "strength factor", ge=1, le=100)(
        1.0,
        "by how many times the strength of a weld to cold plastic, material.interlayer_strength_mpa by "
        "material.cold_weld_factor, must exceed the stress of a base under that push",
    )
    fragile_mm: float = rare("Thinnest sliver", ge=0, le=100)(
        0.3, "no plane leaves a sliver thinner than this, a layer and a half or so, mm"
    )
    pedestal_mm: float = simple("Pedestal height", "raft base lift", ge=0, le=1000)(
        0.0, "height of a pedestal under the model, so that low, strongly tilted cuts become printable, mm"
    )
    simplify_faces: int = rare("Simplify models of more faces than", "reduce triangles decimate", ge=0)(
        20000,
        "a model of more faces is searched on a copy that has fewer and lies within 1.5 layers of it, and cut by the planes that "
        "were found; 0: never",
    )
    most_parts: int = simple("Most parts", "maximum number count", ge=1, le=1000)(12, "the search stops at this number of parts")
    time_limit_s: float | None = advanced("Time for the search", "limit", ge=0)(
        None, "the search ends after this time with the best so far, s"
    )
    least_gain: float = rare("Least share a cut makes safe", ge=0, le=1)(
        0.002, "a cut must make at least this share of the risky area safe, faces that stand on the build plate not counted"
    )
    least_gain_preferred: float = rare("Least share a preferred cut makes safe", ge=0, le=1)(
        1e-4, "the same for parts of the preferred volume in the classic ranking, which may be many (published: 0.01 %)"
    )
    platform_radius_mm: float | None = rare("Radius that planes must clear", gt=0)(
        None, "criterion III: radius of the disc that every plane must clear; absent: the model's footprint"
    )
    count_platform_faces: bool = rare("Count faces on the build plate")(
        False, "true: faces standing on the build plate count as risky (the authors' terms)"
    )
    single_limb: bool = simple("Cut off single limbs", "branch arm leg tree one at a time")(
        True,
        "a cut may take single limbs off and leave others standing beside them, where the head passes clear; false: it takes all "
        "that lies above its plane",
    )
    clearance: bool = rare("Heed the head and the axes", "collision")(
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
