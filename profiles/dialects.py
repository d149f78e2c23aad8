"""Dialects: the firmwares' ways of writing G-code that a machine profile may name; machine/firmware/ writes them."""

FOLLOWS_TABLE = {  # name -> whether its firmware can keep the tip on the workpiece while the table turns (TCP)
    "marlin": True,
    "reprapfirmware": False,
    "klipper": False,
    "klipper_steppers": False,
    "linuxcnc": True,
    "grblhal": True,
}
