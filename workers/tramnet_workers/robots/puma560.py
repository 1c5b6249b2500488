"""The PUMA 560 arm: two published sets of parameters, for two choices of zero and posture.

The same joint angles mean different postures in the two: ``akb`` has the angles of the arm's own VAL
controller (+q2 lowers the upper arm), ``p560`` those of the robotics toolboxes (+q2 raises it).
Friction is in neither, as in Wang & Zalzala (1995).

Torque limits are those of AKB86, table 7, for both: Wang & Zalzala's times are physically out of
reach with the smaller, current-limited ones of Corke (1996, table 2.17: 56, 97, 52, 10, 10, 10 N m).

Sources (as later software quotes them; the papers' own tables were not at hand):
    AKB86: Armstrong, Khatib & Burdick, "The explicit dynamic model and inertial parameters of the
        PUMA 560 arm", ICRA 1986; masses, centres and inertia as quoted by the Robotics
        Toolbox for MATLAB, ``mdl_puma560akb.m``, whose I33 = 0.066 is a slip for AKB86's 0.086.
    CA94: Corke & Armstrong-Helouvry, "A search for consensus among model parameters reported for
        the PUMA 560 robot", ICRA 1994, as in the Robotics Toolbox for Python 1.5.0,
        ``models/DH/Puma560.py``.
"""

from math import pi, radians

from tramnet_workers.robots.arm import SerialArm
from tramnet_workers.robots.denavit_hartenberg import DhLink, modified_dh_arm, standard_dh_arm

_Triple = tuple[float, float, float]
_Row = tuple[float, float, float, float, _Triple, _Triple]

# AKB86, table 7 [N m].
TORQUE_LIMITS = (97.6, 186.4, 89.4, 24.2, 20.1, 21.3)

# Corke, "Visual Control of Robots" (1996), table 2.21: motor saturation over gear ratio [rad/s].
CORKE_VELOCITY_LIMITS = (1.92, 1.51, 2.40, 5.34, 5.09, 5.74)

# alpha, a, d, mass, centre, (Ixx, Iyy, Izz) of each link: AKB86. Of link 1 only Izz is
# given, as nothing else of it moves.
_AKB_LINKS = (
    (0.0, 0.0, 0.0, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.35)),
    (-pi / 2, 0.0, 0.2435, 17.4, (0.068, 0.006, -0.016), (0.13, 0.524, 0.539)),
    (0.0, 0.4318, -0.0934, 4.80, (0.0, -0.070, 0.014), (0.066, 0.0125, 0.086)),
    (pi / 2, -0.0203, 0.4331, 0.82, (0.0, 0.0, -0.019), (1.8e-3, 1.8e-3, 1.3e-3)),
    (-pi / 2, 0.0, 0.0, 0.34, (0.0, 0.0, 0.0), (0.3e-3, 0.3e-3, 0.4e-3)),
    (pi / 2, 0.0, 0.0, 0.09, (0.0, 0.0, 0.032), (0.15e-3, 0.15e-3, 0.04e-3)),
)
# Effective motor inertia at the joint: AKB86 [kg m²].
_AKB_MOTORS = (1.14, 4.71, 0.827, 0.200, 0.179, 0.193)
# Our choice: the ranges of CA94 turned to VAL's zeros; AKB86 gives none [degrees].
_AKB_RANGES = ((-160, 160), (-225, 45), (-45, 225), (-110, 170), (-100, 100), (-266, 266))

# The same columns, and the ranges: CA94. The base stands on a pedestal (26.45 inches in d1).
_P560_LINKS = (
    (pi / 2, 0.0, 0.67183, 0.0, (0.0, 0.0, 0.0), (0.0, 0.35, 0.0)),
    (0.0, 0.4318, 0.0, 17.4, (-0.3638, 0.006, 0.2275), (0.13, 0.524, 0.539)),
    (-pi / 2, 0.0203, 0.15005, 4.80, (-0.0203, -0.0141, 0.070), (0.066, 0.086, 0.0125)),
    (pi / 2, 0.0, 0.4318, 0.82, (0.0, 0.019, 0.0), (1.8e-3, 1.3e-3, 1.8e-3)),
    (-pi / 2, 0.0, 0.0, 0.34, (0.0, 0.0, 0.0), (0.3e-3, 0.4e-3, 0.3e-3)),
    (0.0, 0.0, 0.0, 0.09, (0.0, 0.0, 0.032), (0.15e-3, 0.15e-3, 0.04e-3)),
)
_P560_RANGES = ((-160, 160), (-45, 225), (-225, 45), (-110, 170), (-100, 100), (-266, 266))
# Motor inertia Jm [kg m²] and gear ratio G: CA94; the joint feels Jm G².
_P560_ROTORS = (200e-6, 200e-6, 200e-6, 33e-6, 33e-6, 33e-6)
_P560_GEARS = (-62.6111, 107.815, -53.7063, 76.0364, 71.923, 76.686)


def akb() -> SerialArm:
    """Return the arm of AKB86, in modified Denavit-Hartenberg frames: the default."""
    return modified_dh_arm("puma560-akb", _links(_AKB_LINKS, _AKB_MOTORS, _AKB_RANGES))


def p560() -> SerialArm:
    """Return the arm of CA94, in standard Denavit-Hartenberg frames: the toolboxes' one."""
    motors = tuple(Jm * G**2 for Jm, G in zip(_P560_ROTORS, _P560_GEARS, strict=True))
    return standard_dh_arm("puma560-p560", _links(_P560_LINKS, motors, _P560_RANGES))


def _links(
    rows: tuple[_Row, ...], motors: tuple[float, ...], ranges: tuple[tuple[int, int], ...]
) -> list[DhLink]:
    columns = zip(rows, motors, ranges, TORQUE_LIMITS, strict=True)
    return [
        DhLink(*row, motor, radians(lower), radians(upper), torque)
        for row, motor, (lower, upper), torque in columns
    ]
