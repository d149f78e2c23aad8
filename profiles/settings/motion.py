"""Motion: how fast the head moves along paths and between them."""

from pydantic import Field

from profiles.frozen import Frozen


class Motion(Frozen):
    """Speeds, travels and accelerations."""

    outer_wall_speed_mm_s: float = Field(40.0, gt=0, le=1000, description="speed of outer walls, mm/s")
    inner_wall_speed_mm_s: float = Field(60.0, gt=0, le=1000, description="speed of inner walls, mm/s")
    skin_speed_mm_s: float = Field(60.0, gt=0, le=1000, description="speed of solid skins, mm/s")
    overhang_75_speed_mm_s: float = Field(
        35.0, gt=0, le=1000, description="greatest speed of walls with 50 to 75 % of their width on plastic, mm/s"
    )
    overhang_50_speed_mm_s: float = Field(
        25.0,
        gt=0,
        le=1000,
        description="greatest speed of walls with 25 to 50 % of their width on plastic, mm/s: they must set soon",
    )
    overhang_25_speed_mm_s: float = Field(
        20.0, gt=0, le=1000, description="greatest speed of walls with less than 25 % of their width on plastic, mm/s"
    )
    overhang_0_speed_mm_s: float = Field(
        15.0,
        gt=0,
        le=1000,
        description="greatest speed of walls that nothing carries, mm/s: slow, so that they set before they sag",
    )
    bridge_speed_mm_s: float = Field(
        30.0,
        gt=0,
        le=1000,
        description="speed of bridges, mm/s: faster strands tear, slower ones sag; also the greatest of overhanging walls over "
        "dense support",
    )
    infill_bridge_speed_mm_s: float = Field(
        40.0, gt=0, le=1000, description="speed of the first solid layer over sparse infill, mm/s: it hangs between the lines"
    )
    infill_speed_mm_s: float = Field(80.0, gt=0, le=1000, description="speed of sparse infill, mm/s")
    support_speed_mm_s: float = Field(60.0, gt=0, le=1000, description="speed of support, mm/s")
    support_interface_speed_mm_s: float = Field(
        40.0, gt=0, le=1000, description="speed of the dense layers of support, mm/s: their lines span the sparse ones"
    )
    first_layer_speed_mm_s: float = Field(20.0, gt=0, le=1000, description="speed of the first layer on the plate, mm/s")
    first_layer_infill_speed_mm_s: float | None = Field(
        None,
        gt=0,
        le=1000,
        description="speed of skin and infill in the first layer on the plate, mm/s, once its walls hold; absent: "
        "first_layer_speed_mm_s",
    )
    first_layer_speed_over_raft_mm_s: float = Field(
        30.0, gt=0, le=1000, description="speed of a model's first layer on a raft, which spans the gap between them, mm/s"
    )
    gap_speed_mm_s: float = Field(
        30.0, gt=0, le=1000, description="speed of the lines in gaps between walls, mm/s: their width changes all the time"
    )
    top_skin_speed_mm_s: float = Field(40.0, gt=0, le=1000, description="speed of the uppermost skins, mm/s: they are seen")
    small_wall_mm: float = Field(
        40.0, ge=0, le=1000, description="closed walls no longer than this are small, mm; 40: a hole of 13 mm"
    )
    small_wall_speed_mm_s: float = Field(
        25.0, gt=0, le=1000, description="greatest speed of small walls, mm/s: on a tight curve a fast head rings and pulls"
    )
    travel_speed_mm_s: float = Field(150.0, gt=0, le=2000, description="speed of travels, mm/s")
    lift_speed_mm_s: float = Field(10.0, gt=0, le=500, description="speed of lifts along the nozzle, mm/s")
    retract_travel_mm: float = Field(1.5, ge=0, le=100, description="shortest travel that is worth a retraction, mm")
    combing: bool = Field(
        True, description="true: travels go round through the inside of the layer where that avoids a retraction"
    )
    combing_detour_mm: float = Field(
        8.0,
        ge=0,
        le=1000,
        description="how much longer than straight such a way may be; 8 mm take as long as pulling back and priming 0.8 mm, mm",
    )
    lift_mm: float = Field(
        0.2,
        ge=0,
        le=10,
        description="lift along the nozzle for travels that retract, mm; a layer's height clears what has curled up",
    )
    acceleration_mm_s2: float | None = Field(
        None, gt=0, le=100000, description="acceleration of every stroke; absent: what the axes allow, mm/s2"
    )
    outer_wall_acceleration_mm_s2: float | None = Field(
        None, gt=0, le=100000, description="acceleration of outer walls; absent: acceleration_mm_s2, mm/s2"
    )
    infill_acceleration_mm_s2: float | None = Field(
        None, gt=0, le=100000, description="acceleration of sparse infill and support; absent: acceleration_mm_s2, mm/s2"
    )
    bridge_acceleration_mm_s2: float | None = Field(
        None, gt=0, le=100000, description="acceleration of bridges and overhanging walls; absent: acceleration_mm_s2, mm/s2"
    )
    first_layer_acceleration_mm_s2: float | None = Field(
        None, gt=0, le=100000, description="acceleration of the first layer on the plate; absent: acceleration_mm_s2, mm/s2"
    )
    travel_acceleration_mm_s2: float | None = Field(
        None, gt=0, le=100000, description="acceleration of travels; absent: acceleration_mm_s2, mm/s2"
    )
    least_layer_time_s: float = Field(5.0, ge=0, le=600, description="layers printed faster than this are slowed down, s")
    least_speed_mm_s: float = Field(10.0, gt=0, le=1000, description="slowing for the layer time stops here, mm/s")
