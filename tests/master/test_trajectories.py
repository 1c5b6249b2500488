import numpy as np
import pytest

from tramnet_master.errors import DamagedFile
from tramnet_master.trajectories import Trajectory, write_nodes


def trajectory(n_joints: int, k: int = 5) -> Trajectory:
    rng = np.random.default_rng(7)
    q, qd, qdd, tau = rng.normal(size=(4, k, n_joints))
    return Trajectory(np.linspace(0.0, 0.4, k), q, qd, qdd, tau, np.abs(tau) / 50.0)


@pytest.mark.parametrize("n_joints", [1, 2, 6, 8, 12])
def test_a_trajectory_reads_back_bit_for_bit_for_any_number_of_joints(tmp_path, n_joints):
    written = trajectory(n_joints)

    written.write(tmp_path / "trajectory.csv")

    read = Trajectory.read(tmp_path / "trajectory.csv")
    assert read.n_joints == n_joints
    for name in ("t", "q", "qd", "qdd", "tau", "ratio"):
        np.testing.assert_array_equal(getattr(read, name), getattr(written, name))


def test_the_columns_of_a_trajectory_carry_their_units(tmp_path):
    trajectory(2).write(tmp_path / "trajectory.csv")

    head = (tmp_path / "trajectory.csv").read_text().splitlines()[0]
    assert head == (
        "t_s,q1_rad,q2_rad,qd1_rad_s,qd2_rad_s,qdd1_rad_s2,qdd2_rad_s2,tau1_nm,tau2_nm,"
        "ratio1,ratio2"
    )


def test_a_trajectory_cannot_be_altered():
    with pytest.raises(ValueError, match="read-only"):
        trajectory(2).q[0, 0] = 1.0


@pytest.mark.parametrize("missing", ["t_s", "tau1_nm"])
def test_a_file_without_a_column_is_no_trajectory(tmp_path, missing):
    path = tmp_path / "trajectory.csv"
    trajectory(1).write(path)
    path.write_text(path.read_text().replace(missing, "other"))

    with pytest.raises(DamagedFile, match=f"expected {missing}"):
        Trajectory.read(path)


def test_nodes_have_a_number_a_time_angles_and_velocities(tmp_path):
    path = tmp_path / "nodes.csv"

    write_nodes(path, np.array([0.0, 0.1]), np.eye(2), 2 * np.eye(2))

    assert path.read_text().splitlines() == [
        "node,t_s,q1_rad,q2_rad,qd1_rad_s,qd2_rad_s",
        "0,0.0,1.0,0.0,2.0,0.0",
        "1,0.1,0.0,1.0,0.0,2.0",
    ]
