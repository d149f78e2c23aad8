"""Probing: a machine that senses contact finds its own axes, from the centre of one ball on the plate at many poses.

`ball` finds the centre from contacts along Z and says what of the head would meet the ball, `measure` plans pose after pose with
what is known so far and yields the touches that `machine.setup.calibration.fit` works with.
"""
