"""The options that mean the same in every command, each also an environment variable."""

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

_FARM = "The farm"
_RUN = "The run"

Seed: TypeAlias = Annotated[
    int,
    typer.Option(
        min=0, max=2**63 - 1, envvar="TRAMNET_SEED", help="Same seed, same result, bit for bit."
    ),
]
Population: TypeAlias = Annotated[
    int | None,
    typer.Option(
        min=2,
        max=100_000,
        envvar="TRAMNET_POPULATION",
        help="Individuals; the method's own if omitted.",
    ),
]
Generations: TypeAlias = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=10_000_000,
        envvar="TRAMNET_GENERATIONS",
        help="Generations; the method's own if omitted.",
    ),
]
Task: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        exists=False, dir_okay=True, envvar="TRAMNET_TASK", help="A task of your own, in TOML."
    ),
]
Workers: TypeAlias = Annotated[
    int,
    typer.Option(
        min=0, max=4094, envvar="TRAMNET_WORKERS", rich_help_panel=_FARM,
        help="Local worker processes; 0 waits for workers from elsewhere.",
    ),
]  # fmt: skip
Topology: TypeAlias = Annotated[
    str,
    typer.Option(
        envvar="TRAMNET_TOPOLOGY", rich_help_panel=_FARM,
        help="Shape of the network: star, pipeline, ring, tree, grid, torus, hypercube or LINKS.toml.",
    ),
]  # fmt: skip
Network: TypeAlias = Annotated[
    str | None,
    typer.Option(
        envvar="TRAMNET_NETWORK", rich_help_panel=_FARM,
        help="Name of the network; a free name, or the only live one, if omitted.",
    ),
]  # fmt: skip
Listen: TypeAlias = Annotated[
    str,
    typer.Option(
        envvar="TRAMNET_LISTEN", rich_help_panel=_FARM,
        help="Where the root listens for workers; beyond loopback only if you say so.",
    ),
]  # fmt: skip
Observers: TypeAlias = Annotated[
    str | None,
    typer.Option(
        envvar="TRAMNET_OBSERVERS", rich_help_panel=_FARM,
        help="Where observers of other machines attach, ws/HOST:PORT; those of this one need nothing.",
    ),
]  # fmt: skip
Connect: TypeAlias = Annotated[
    str | None,
    typer.Option(
        envvar="TRAMNET_CONNECT", rich_help_panel=_FARM,
        help="Where the root listens, tcp/HOST:PORT; the live network of this machine if omitted.",
    ),
]  # fmt: skip
Attach: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--connect", envvar="TRAMNET_CONNECT", rich_help_panel=_FARM,
        help="Where the root has observers attach (its --observers); this machine's live network if omitted.",
    ),
]  # fmt: skip
FirstDeadline: TypeAlias = Annotated[
    float,
    typer.Option(
        min=0.1, envvar="TRAMNET_FIRST_DEADLINE", rich_help_panel=_FARM,
        help="Seconds an individual may take before its cost is known.",
    ),
]  # fmt: skip
OnFailure: TypeAlias = Annotated[
    str,
    typer.Option(
        envvar="TRAMNET_ON_FAILURE", rich_help_panel=_FARM,
        help="What becomes of an individual that cannot be evaluated: penalise, retry or stop.",
    ),
]  # fmt: skip
AllowMixed: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--allow-mixed", envvar="TRAMNET_ALLOW_MIXED", rich_help_panel=_FARM,
        help="Admit workers whose arithmetic differs; the result is then not reproducible.",
    ),
]  # fmt: skip
Out: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        envvar="TRAMNET_OUT",
        rich_help_panel=_RUN,
        help="Run folder; a new one under runs/ if omitted.",
    ),
]
Overwrite: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--overwrite",
        envvar="TRAMNET_OVERWRITE",
        rich_help_panel=_RUN,
        help="Replace a run in that folder.",
    ),
]
Pictures: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--pictures/--no-pictures", envvar="TRAMNET_PICTURES", rich_help_panel=_RUN,
        help="Draw the figures at the end.",
    ),
]  # fmt: skip
Progress: TypeAlias = Annotated[
    str,
    typer.Option(
        "--progress", envvar="TRAMNET_PROGRESS", rich_help_panel=_RUN,
        help="What to show on the way: auto, quiet or json.",
    ),
]  # fmt: skip
CheckpointSeconds: TypeAlias = Annotated[
    float,
    typer.Option(
        min=0.0, envvar="TRAMNET_CHECKPOINT_SECONDS", rich_help_panel=_RUN,
        help="Seconds between checkpoints.",
    ),
]  # fmt: skip
Node: TypeAlias = Annotated[
    str,
    typer.Option(
        envvar="TRAMNET_NODE", rich_help_panel=_FARM,
        help="Machine of the 1990s to keep link books for, in virtual time: t805-25, or none.",
    ),
]  # fmt: skip
Pace: TypeAlias = Annotated[
    bool,
    typer.Option(
        "--pace", envvar="TRAMNET_PACE", rich_help_panel=_FARM,
        help="Let frames really take as long as on a transputer's links, to show it.",
    ),
]  # fmt: skip
Mbaud: TypeAlias = Annotated[
    int,
    typer.Option(
        envvar="TRAMNET_MBAUD", rich_help_panel=_FARM,
        help="Speed of a transputer's links: 5, 10 or 20.",
    ),
]  # fmt: skip
CheckpointGenerations: TypeAlias = Annotated[
    int,
    typer.Option(
        min=0, envvar="TRAMNET_CHECKPOINT_GENERATIONS", rich_help_panel=_RUN,
        help="Generations between checkpoints; 0 goes by time.",
    ),
]  # fmt: skip
Deadline: TypeAlias = Annotated[
    float,
    typer.Option(
        min=0.01, envvar="TRAMNET_DEADLINE", rich_help_panel=_FARM,
        help="Seconds any chunk may take; more where ten times its measured cost is more.",
    ),
]  # fmt: skip
WorkerMemory: TypeAlias = Annotated[
    int,
    typer.Option(
        min=0, envvar="TRAMNET_WORKER_MEMORY", rich_help_panel=_FARM,
        help="Memory a local worker may have in MiB; 0 for any.",
    ),
]  # fmt: skip
Tls: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        envvar="TRAMNET_TLS", rich_help_panel=_FARM,
        help="Folder with this host's certificate and key; see `tramnet certificates`.",
    ),
]  # fmt: skip
Audit: TypeAlias = Annotated[
    float,
    typer.Option(
        min=0.0, max=1.0, envvar="TRAMNET_AUDIT", rich_help_panel=_FARM,
        help="Share of the answers that the root computes again, to expel workers that lie; 0 for none.",
    ),
]  # fmt: skip
