"""Labels: of every key by its dotted name, of the groups they stand in, and the unit that a key's name ends with.

>>> label_of("process.layer_height_mm").text, unit_of("process.layer_height_mm")
('Layer height', 'mm')
"""

from profiles.labels.label import Label
from profiles.labels.of_machine import MACHINE
from profiles.labels.of_material import MATERIAL
from profiles.labels.of_process import PROCESS
from profiles.labels.of_search import SEARCH

SECTIONS = {"machine": MACHINE, "material": MATERIAL, "process": PROCESS, "search": SEARCH}
LABELS: dict[str, Label] = {f"{section}.{key}": label for section, own in SECTIONS.items() for key, label in own.items()}
# By a matter of the process as its class is called, a table of the machine, or a section.
TITLES = {
    "process: layers": "Layers and lines",
    "process: shell": "Walls, top and bottom",
    "process: finish": "Sizes and smooth tops",
    "process: infill": "Infill",
    "process: support": "Support and bridges",
    "process: plate": "Skirt, brim and plate",
    "process: interface": "Joints between parts",
    "process: motion": "Speeds and travels",
    "material": "Material",
    "search": "Finding parts",
    "machine": "Machine",
    "machine.x": "X axis",
    "machine.y": "Y axis",
    "machine.z": "Z axis",
    "machine.tilt": "Tilt axis",
    "machine.turn": "Turn axis",
    "machine.table": "Table",
    "machine.head": "Print head",
    "machine.gcode": "G-code blocks",
}
UNITS = (
    ("_g_cm3", "g/cm³"),
    ("_mm3_s", "mm³/s"),
    ("_mm_s2", "mm/s²"),
    ("_deg_s2", "°/s²"),
    ("_mm_s", "mm/s"),
    ("_deg_s", "°/s"),
    ("_c_s", "°C/s"),
    ("_mm2", "mm²"),
    ("_mm", "mm"),
    ("_deg", "°"),
    ("_c", "°C"),
    ("_s", "s"),
    ("_min", "min"),
    ("_mpa", "MPa"),
    ("_n", "N"),
    ("_px", "px"),
    ("_bytes", "bytes"),
)


def label_of(key: str) -> Label:
    """The label of a dotted key. Raises KeyError for one that is none."""
    return LABELS[key]


def group_title(group: str) -> str:
    """The title of a group of keys. Raises KeyError for one that is none."""
    return TITLES[group]


def unit_of(key: str) -> str:
    """The unit of a key's value as a page shows it; "": it has none.

    >>> unit_of("machine.tilt.acceleration_deg_s2"), unit_of("process.walls")
    ('°/s²', '')
    """
    return next((unit for ending, unit in UNITS if key.endswith(ending)), "")
