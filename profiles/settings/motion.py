"""Motion: speeds along paths and between them."""

from profiles.frozen import Frozen, advanced, simple


class Motion(Frozen):
    """Speeds, travels and accelerations."""

    outer_wall_speed_mm_s: float = simple("Outer wall speed", "external perimeters speed", gt=0, le=1000)(
        40.0, "speed of outer walls, mm/s"
    )
    inner_wall_speed_mm_s: float = simple("Inner wall speed", "perimeters speed", gt=0, le=1000)(
        60.0, "speed of inner walls, mm/s"
    )
    skin_speed_mm_s: float = advanced("Solid infill speed", "internal solid infill speed", gt=0, le=1000)(
        60.0, "speed of solid skins, mm/s"
    )
    overhang_75_speed_mm_s: float = advanced("Overhang speed, 50 to 75 % carried", "overhangs slow down dynamic", gt=0, le=1000)(
        35.0, "speed limit of walls 50 to 75 % on plastic, mm/s"
    )
    overhang_50_speed_mm_s: float = advanced("Overhang speed, 25 to 50 % carried", "overhangs slow down dynamic", gt=0, le=1000)(
        25.0, "speed limit of walls 25 to 50 % on plastic, mm/s: they must set soon"
    )
    overhang_25_speed_mm_s: float = advanced(
        "Overhang speed, less than 25 % carried", "overhangs slow down dynamic", gt=0, le=1000
    )(20.0, "speed limit of walls below 25 % on plastic, mm/s")
    overhang_0_speed_mm_s: float = advanced("Overhang speed, nothing below", "overhangs slow down dynamic", gt=0, le=1000)(
        15.0, "speed limit of walls over air, mm/s: slow, so that they set before they sag"
    )
    bridge_speed_mm_s: float = advanced("Bridge speed", "bridging bridges", gt=0, le=1000)(
        30.0,
        "speed of bridges, mm/s: faster strands tear, slower ones sag; also the greatest of overhanging walls over dense support",
    )
    infill_bridge_speed_mm_s: float = advanced(
        "Speed of the first solid layer over infill", "internal bridge speed", gt=0, le=1000
    )(40.0, "speed of the first solid layer over infill, mm/s: it hangs between the lines")
    infill_speed_mm_s: float = simple("Infill speed", "sparse infill fill speed", gt=0, le=1000)(
        80.0, "speed of sparse infill, mm/s"
    )
    support_speed_mm_s: float = advanced("Support speed", "supports support material speed", gt=0, le=1000)(
        60.0, "speed of support, mm/s"
    )
    support_interface_speed_mm_s: float = advanced("Speed of dense support", "supports interface speed", gt=0, le=1000)(
        40.0, "speed of the dense layers of support, mm/s: their lines span the sparse ones"
    )
    first_layer_speed_mm_s: float = simple("First layer speed", "initial layer speed adhesion", gt=0, le=1000)(
        20.0, "speed of the first layer, mm/s"
    )
    first_layer_infill_speed_mm_s: float | None = advanced(
        "First layer infill speed", "initial layer infill speed", gt=0, le=1000
    )(None, "speed of skin and infill in the first layer, mm/s; absent: first_layer_speed_mm_s")
    first_layer_speed_over_raft_mm_s: float = advanced(
        "First layer speed on a raft", "initial layer speed over raft", gt=0, le=1000
    )(30.0, "speed of the model's first layer on a raft, mm/s")
    gap_speed_mm_s: float = advanced("Gap fill speed", "gap infill thin walls", gt=0, le=1000)(
        30.0, "speed of gap fill, mm/s: their width changes all the time"
    )
    top_skin_speed_mm_s: float = advanced("Top surface speed", "top solid infill speed", gt=0, le=1000)(
        40.0, "speed of top skins, mm/s: they are seen"
    )
    small_wall_mm: float = advanced("Walls are small up to", "small perimeters threshold", ge=0, le=1000)(
        40.0, "greatest length of a small wall, mm; 40: a hole of 13 mm"
    )
    small_wall_speed_mm_s: float = advanced("Small wall speed", "small perimeters speed holes", gt=0, le=1000)(
        25.0, "greatest speed of small walls, mm/s: on a tight curve a fast head rings and pulls"
    )
    travel_speed_mm_s: float = simple("Travel speed", "non-print moves", gt=0, le=2000)(150.0, "speed of travels, mm/s")
    lift_speed_mm_s: float = advanced("Lift speed", "z hop travel speed z", gt=0, le=500)(
        10.0, "speed of lifts along the nozzle, mm/s"
    )
    retract_travel_mm: float = advanced(
        "Retract on travels longer than", "retraction minimum travel after retraction stringing", ge=0, le=100
    )(1.5, "shortest travel with a retraction, mm")
    combing: bool = advanced("Travel inside the part", "avoid dont don't cross crossing perimeters walls combing stringing")(
        True, "true: travels stay inside where that avoids a retraction"
    )
    combing_detour_mm: float = advanced(
        "Longest detour inside", "avoid crossing perimeters walls max detour combing", ge=0, le=1000
    )(8.0, "greatest length that combing adds to a travel, mm; 8 mm take as long as retracting and priming 0.8 mm")
    lift_mm: float = advanced("Lift on travels", "z hop z lift retract retraction", ge=0, le=10)(
        0.2, "lift along the nozzle on retracted travels, mm; a layer's height clears what has curled up"
    )
    acceleration_mm_s2: float | None = advanced("Acceleration", "default acceleration", gt=0, le=100000)(
        None, "acceleration of every stroke; absent: what the axes allow, mm/s²"
    )
    outer_wall_acceleration_mm_s2: float | None = advanced("Outer wall acceleration", "external perimeters", gt=0, le=100000)(
        None, "acceleration of outer walls; absent: acceleration_mm_s2, mm/s²"
    )
    infill_acceleration_mm_s2: float | None = advanced("Infill acceleration", "sparse infill supports", gt=0, le=100000)(
        None, "acceleration of sparse infill and support; absent: acceleration_mm_s2, mm/s²"
    )
    bridge_acceleration_mm_s2: float | None = advanced("Bridge acceleration", "bridging overhangs", gt=0, le=100000)(
        None, "acceleration of bridges and overhanging walls; absent: acceleration_mm_s2, mm/s²"
    )
    first_layer_acceleration_mm_s2: float | None = advanced("First layer acceleration", "initial layer", gt=0, le=100000)(
        None, "acceleration of the first layer; absent: acceleration_mm_s2, mm/s²"
    )
    travel_acceleration_mm_s2: float | None = advanced("Travel acceleration", "non-print moves", gt=0, le=100000)(
        None, "acceleration of travels; absent: acceleration_mm_s2, mm/s²"
    )
    least_layer_time_s: float = advanced("Least layer time", "minimum layer time slow down cooling", ge=0, le=600)(
        5.0, "shorter layers are slowed to this time, s"
    )
    least_speed_mm_s: float = advanced("Slowest speed for cooling", "minimum print speed slow down cooling", gt=0, le=1000)(
        10.0, "least speed when slowing for the layer time, mm/s"
    )
