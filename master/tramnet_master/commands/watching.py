"""What the commands that watch a network share: they attach, say what is to be said, and take their leave."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tramnet_master.console import people
from tramnet_master.traffic.observing import Observation, observe


@contextmanager
def watching(
    connect: str | None, network: str | None, tls: Path | None
) -> Iterator[tuple[Observation, dict[str, object]]]:
    """Watch a network until the block ends.

    Args:
        connect: Endpoint of the root for observers, or None.
        network: Name of the network, or None for the only live one.
        tls: Folder with the root's certificate, for a root elsewhere that asks for one.

    Yields:
        The network, and what its root says of itself.
    """
    with observe(connect, network, tls) as observation:
        said = observation.first_status()
        if observation.in_the_way(said):
            people.print(
                "note: this is where workers attach, so a watcher that hangs can hold the network up for a "
                "second; a root started with --observers has a place of its own for watchers",
                soft_wrap=True,
            )
        yield observation, said
        if observation.ended:
            people.print(f"network {observation.live.network} has ended")
