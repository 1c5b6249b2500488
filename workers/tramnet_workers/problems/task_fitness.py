"""Which methods a design task is fit for; what is not is refused before anything is searched."""

from tramnet_workers.errors import InvalidTask
from tramnet_workers.problems.design_task import DesignTask


def require_exact_poses(task: DesignTask) -> None:
    """Check that the best poses of given links can be found exactly.

    Raises:
        InvalidTask: The arm has not three revolute joints alone.
    """
    if task.n_links != 3 or task.strokes:
        found = f"{task.n_links} links and {len(task.strokes)} strokes"
        raise InvalidTask("lower", found, "three links and no stroke, for exact poses")


def require_links_to_find(task: DesignTask) -> None:
    """Check that three links are to be designed, on a base that stands still.

    Raises:
        InvalidTask: The arm is given or of another kind, or its base moves.
    """
    require_exact_poses(task)
    if task.lengths is not None:
        raise InvalidTask("lengths", "a given arm", "none, for links that are to be designed")
    if task.mobility is not None:
        expected = "none, for poses of a base that stands still"
        raise InvalidTask("mobility", f"{task.mobility}", expected)


def require_something_to_find(task: DesignTask) -> None:
    """Check that a point does not already decide what the arm is, and that it can be built.

    Raises:
        InvalidTask: A single link leads from a given base to the points, or modules are too few.
    """
    if task.lengths is None and task.n_links == 1 and not (task.strokes or task.base.free):
        expected = "two links, a stroke or a free base: one link alone leaves nothing to find"
        raise InvalidTask("lower", "1 link", expected)
    if task.lengths is None and sum(task.stock.quantities) < task.n_links:
        found = f"{sum(task.stock.quantities)} modules"
        raise InvalidTask("stock", found, f"modules for {task.n_links} links")
