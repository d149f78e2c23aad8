"""The search: how the parts of a model are looked for; a table of a process profile."""

from typing import Literal

from pydantic import Field

from profiles.frozen import Frozen

PUBLISHED = {"least_volume_share": 0.1, "least_interface_mm2": 0.0, "least_gain": 1e-4, "objective": "risky"}
OF_SCARS = {"seam_mm": 0.0, "nozzle_load_n": 0.0, "single_limb": False}  # what the paper's terms do not know
OF_SEAMS = {
    "cut_mm2": 0.0,
    "second_mm2": 0.0,
    "metre_mm2": 0.0,
    "hidden_seam_share": 1.0,
    "stair_weight": 0.0,
    "feature_weight": 1.0,
    "feature_mm2": 0.0,
}


class Search(Frozen):
    """How the parts are searched."""

    directions: int = Field(600, ge=1, le=100000, description="directions sampled on the Gaussian sphere")
    least_elevation_deg: float = Field(10.0, ge=0, le=89, description="least angle of a direction above the platform, deg")
    offset_step_mm: float = Field(1.0, gt=0, le=100, description="distance of the sampled planes of a direction, mm")
    method: Literal["best", "published"] = Field(
        "best", description="published: the authors' stop rule and bookkeeping, for comparisons; best: ours"
    )
    beam_width: int = Field(4, ge=1, le=1000, description="how many decompositions are followed at a time")
    objective: Literal["scar", "risky"] = Field(
        "scar",
        description="scar: area that needs support and the seams of the cuts, each as wide as its scar; risky: the area alone, "
        "the terms of the 2020 paper",
    )
    seam_mm: float = Field(
        5.0,
        ge=0,
        le=100,
        description="width of the scar that a seam leaves on a model of 100 mm from end to end, in proportion on others, mm: a "
        "cut must make more surface safe than its rim takes; 0: the paper's objective",
    )
    feather_weight: float = Field(
        0.5,
        ge=0,
        le=100,
        description="by how much more a seam counts where face and plane meet at less than 30 deg, times cot angle - cot 30: "
        "such edges are thin, warp and break",
    )
    cut_mm2: float = Field(
        10.0,
        ge=0,
        le=10000,
        description="what a cut costs beside its seam: one more turn, one more joint that can fail, mm2; a cut that saves less "
        "than its seam and this is not made",
    )
    stair_weight: float = Field(
        0.1,
        ge=0,
        le=10,
        description="how much an area counts that shows stairs as high as a layer of 0.2 mm, beside 1 where support scars it; "
        "less where the layers or the angle make them lower: walls and level faces show none, so parts are printed along their "
        "faces; 0: stairs do not count",
    )
    second_mm2: float = Field(
        0.1,
        ge=0,
        le=1000,
        description="what a second of printing counts in the choice between numbers of parts and orientations: so much surface "
        "that a seam or support blemishes, mm2 (1 cm2 is worth 1000 s); 0: time is free, as it is without support",
    )
    metre_mm2: float = Field(
        100.0,
        ge=0,
        le=1e5,
        description="what a metre of filament counts there, mm2 (as 1000 s do: support has to be removed again); "
        "0: it is free, as it is without support",
    )
    hidden_seam_share: float = Field(
        0.25,
        gt=0,
        le=1,
        description="how much a seam counts deep in a crease or neck or out of sight, as a share of what it counts across a "
        "smooth surface in plain sight; 1: the same everywhere",
    )
    feature_weight: float = Field(
        4.0,
        ge=1,
        le=1000,
        description="how many times a seam counts across a bore, where a ridge spoils a fit; 1: as elsewhere",
    )
    feature_mm2: float = Field(
        500.0,
        ge=0,
        le=1e5,
        description="what it costs beside its seam that a cut passes askew through a bore, which then holds and guides "
        "nothing, mm2; one across its axis leaves it round and costs nothing",
    )
    unsupportable_weight: float = Field(
        5.0,
        ge=1,
        le=1000,
        description="how many times an area counts that needs support and has nothing but air beneath it along its part's "
        "direction: support leans there from the side or stands on support printed with other parts, which takes more plastic "
        "and holds less well",
    )
    least_saving: float = Field(
        0.03,
        ge=0,
        le=1,
        description="share of what one piece costs, with its time and filament, that every further part must save; where more "
        "parts would save less, a note says so, and --parts N takes them",
    )
    polish: bool = Field(
        True,
        description="the best results of a beam of two or more are shortened, their planes moved off the grid and cuts added",
    )
    least_volume_share: float = Field(
        0.02, ge=0, lt=1, description="criterion IV: a part has at least this share of the model's volume (published: 0.1)"
    )
    preferred_volume_share: float = Field(
        0.1,
        ge=0,
        lt=1,
        description="criterion IV as a preference: the classic ranking takes parts of at least this share of the volume first",
    )
    least_interface_mm2: float = Field(
        4.0, ge=0, le=1e6, description="least area that a part, and each of its pieces that is no crumb, stands on, mm2"
    )
    nozzle_load_n: float = Field(
        5.0,
        ge=0,
        le=1000,
        description="push of the nozzle against the top of a part, sideways, that its base must bear while it is printed, N; 0: "
        "strength is not looked at",
    )
    strength_safety: float = Field(
        1.0,
        ge=1,
        le=100,
        description="by how many times the strength of a weld to cold plastic, material.interlayer_strength_mpa by "
        "material.cold_weld_factor, must exceed the stress of a base under that push",
    )
    fragile_mm: float = Field(
        0.3, ge=0, le=100, description="no plane leaves a sliver thinner than this, a layer and a half or so, mm"
    )
    pedestal_mm: float = Field(
        0.0,
        ge=0,
        le=1000,
        description="height of a pedestal under the model, so that low, strongly tilted cuts become printable, mm",
    )
    simplify_faces: int = Field(
        20000,
        ge=0,
        description="a model of more faces is searched on a copy that has fewer and lies within 1.5 layers of it, and "
        "cut by the planes that were found; 0: never",
    )
    most_parts: int = Field(12, ge=1, le=1000, description="the search stops at this number of parts")
    time_limit_s: float | None = Field(None, ge=0, description="the search ends after this time with the best so far, s")
    least_gain: float = Field(
        0.002,
        ge=0,
        le=1,
        description="a cut must make at least this share of the risky area safe, faces that stand on the platform not counted",
    )
    least_gain_preferred: float = Field(
        1e-4,
        ge=0,
        le=1,
        description="the same for parts of the preferred volume in the classic ranking, which may be many (published: 0.0001)",
    )
    platform_radius_mm: float | None = Field(
        None, gt=0, description="criterion III: radius of the disc that every plane must clear; absent: the model's footprint"
    )
    count_platform_faces: bool = Field(
        False, description="true: faces standing on the platform count as risky (the authors' terms)"
    )
    single_limb: bool = Field(
        True,
        description="a cut may take single limbs off and leave others standing beside them, where the head passes clear; false: "
        "it takes all that lies above its plane",
    )
    clearance: bool = Field(True, description="false: the head's bodies and the axis limits are ignored (the authors' terms)")

    @property
    def effective(self) -> "Search":
        """The settings as they hold: the published search has the paper's terms, and what means nothing beside others is nothing.

        >>> Search(objective="risky").effective.cut_mm2
        0.0
        """
        published = PUBLISHED if self.method == "published" else {}
        paper = OF_SCARS if published or self.objective == "risky" else {}
        free = OF_SEAMS if paper or self.seam_mm == 0.0 else {}
        return self.model_copy(update={**published, **paper, **free})
