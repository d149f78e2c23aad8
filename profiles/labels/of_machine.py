"""Labels of a machine: of its own keys and of its tables."""

from profiles.labels.label import Label, advanced, rare, simple

LINEAR = {
    "limits_mm": advanced("Travel", "limits build volume size stroke"),
    "speed_mm_s": advanced("Greatest speed", "maximum feedrate"),
    "acceleration_mm_s2": advanced("Greatest acceleration", "maximum"),
    "home_mm": rare("Position at home", "endstop"),
}
ROTARY = {
    "letter": advanced("Letter in G-code", "axis A B C"),
    "stepper": rare("Stepper in Klipper", "manual_stepper"),
    "axis": advanced("Direction of the axis"),
    "point_mm": advanced("Point on the axis", "centre of rotation calibration offset"),
    "sign": advanced("Sense of turning", "direction invert"),
    "zero_deg": advanced("Value when level", "offset zero"),
    "limits_deg": advanced("Range", "limits angle"),
    "budget_deg": advanced("Winding of the cables", "limit"),
    "speed_deg_s": advanced("Greatest speed", "maximum feedrate"),
    "acceleration_deg_s2": advanced("Greatest acceleration", "maximum"),
    "home_deg": rare("Position at home", "endstop"),
}
OWN = {
    "name": advanced("Name of the machine", "printer"),
    "shape": advanced("Shape", "kinematics 3-axis 5-axis"),
    "dialect": advanced("Firmware", "G-code flavor marlin klipper"),
    "coordinates": advanced("Meaning of X Y Z", "tool centre point TCP"),
    "tool_mm": advanced("From the tip to X Y Z", "tool offset length"),
    "junction_speed_mm_s": advanced("Corner speed", "jerk junction deviation square corner velocity"),
    "receive_bytes": rare("Receive buffer", "RX_BUFFER_SIZE serial"),
    "extruder_speed_mm_s": advanced("Extruder speed", "E maximum feedrate"),
    "extruder_acceleration_mm_s2": advanced("Extruder acceleration", "E maximum"),
    "arcs": advanced("Arcs", "arc fitting G2 G3 welder"),
    "arc_tolerance_mm": advanced("Arc tolerance", "arc fitting resolution"),
    "cradle": rare("Bodies that tilt with the table", "collision"),
    "clearance_mm": advanced("Clearance between head and table", "collision distance"),
    "lift_mm": advanced("Lift while the table moves", "z hop"),
    "pause_cools_after_min": advanced("Nozzle off after a pause of, minutes", "idle timeout"),
    "purge_mm": simple("Purge line", "prime line intro wipe"),
    "nozzle_limit_c": advanced("Hottest nozzle", "maximum temperature"),
    "nozzle_heating_c_s": rare("Heating of the nozzle", "heat-up rate"),
    "bed_limit_c": advanced("Hottest bed", "maximum temperature heatbed"),
    "thumbnails_px": advanced("Pictures in the G-code", "thumbnails preview"),
    "uncalibrated": rare("Keys without a source", "calibration"),
    "sources": rare("Sources of values"),
}
TABLES = {
    "table.radius_mm": simple("Radius", "bed size build plate diameter"),
    "table.size_mm": simple("Size of a rectangle", "bed size build plate shape"),
    "table.thickness_mm": rare("Thickness", "build plate"),
    "head.nozzle_mm": simple("Nozzle diameter", "size"),
    "head.silhouette_mm": advanced("Silhouette of the hot end", "extruder clearance radius collision"),
    "head.boxes": advanced("Bodies beside the nozzle", "extruder clearance fan duct collision"),
    "gcode.start": advanced("Start G-code", "custom script begin"),
    "gcode.end": advanced("End G-code", "custom script finish"),
    "gcode.before_part": advanced("G-code before a part", "custom script"),
    "gcode.after_part": advanced("G-code after a part", "custom script"),
    "gcode.before_layer": advanced("G-code before a layer", "custom script layer change before_layer_gcode layer_gcode"),
    "gcode.resume": rare("G-code after a power cut", "custom script recovery"),
}
MACHINE: dict[str, Label] = {
    **OWN,
    **{f"{axis}.{key}": label for axis in ("x", "y", "z") for key, label in LINEAR.items()},
    **{f"{axis}.{key}": label for axis in ("tilt", "turn") for key, label in ROTARY.items()},
    **TABLES,
}
