"""Where the joints of a designed arm are in its poses."""

import numpy as np
from numpy.typing import NDArray

from tramnet_master.reports.design_record import DesignFile, DesignPoint

Floats = NDArray[np.float64]


def arm_shape(design: DesignFile, point: DesignPoint) -> Floats:
    """Places of the joints and the tip, from the base on, of shape (n + 1, 2) or (n + 1, 3) [m]."""
    return _spatial(design, point) if design.spatial else _planar(design, point)


def _planar(design: DesignFile, point: DesignPoint) -> Floats:
    lengths = np.array(design.link_lengths_m)
    for link, stroke in zip(design.prismatic_links, point.strokes_m, strict=True):
        lengths[link - 1] += stroke
    turns = np.cumsum(point.pose_rad)
    links = lengths[:, None] * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return np.concatenate([[point.base_m], point.base_m + np.cumsum(links, axis=0)])


def _spatial(design: DesignFile, point: DesignPoint) -> Floats:
    """Standard Denavit-Hartenberg rows: Rz(theta) Tz(d) Tx(a) Rx(alpha)."""
    places, place, axes = [np.array(point.base_m)], np.array(point.base_m), np.eye(3)
    for (a, d, alpha), theta in zip(design.rows, point.pose_rad, strict=True):
        axes = axes @ _turn(theta, 2)
        # Two corners a joint: along its axis, then along the link.
        for step in (d * axes[:, 2], a * axes[:, 0]):
            place = place + step
            places.append(place)
        axes = axes @ _turn(alpha, 0)
    return np.array(places)


def _turn(angle: float, axis: int) -> Floats:
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = np.cos(angle)
    matrix[j, i], matrix[i, j] = np.sin(angle), -np.sin(angle)
    return matrix
