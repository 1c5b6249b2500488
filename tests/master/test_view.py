import csv
import io
import json

import pytest
from rich.cells import cell_len
from rich.console import Console

from tramnet_master.errors import RunFailed
from tramnet_master.traffic.controls import View, press
from tramnet_master.traffic.inspector import Inspector
from tramnet_master.traffic.picture import write_picture
from tramnet_master.traffic.rows import TABLES, LinkRow
from tramnet_master.traffic.selection import Selection, parse_filter
from tramnet_master.traffic.snapshot import csv_lines, document, take
from tramnet_master.traffic.sniffer import Sniffer
from tramnet_master.traffic.view import render
from tramnet_master.traffic.words import json_line
from tramnet_protocol.codec import Header, encode
from tramnet_protocol.keys import Keys
from tramnet_protocol.messages import LinkCounters, Stats, Stop, TagCounters

ALL = View(tuple(TABLES))
HOSTILE = "[red]\x1b[2Jhost[/red]"


def status(n_workers, **fields):
    workers = [
        {"seat": seat, "incarnation": seat, "live": True, "host": HOSTILE, "pid": 4000 + seat}
        for seat in range(1, n_workers + 1)
    ]
    return {
        "network": "tramnet", "title": "puma560 case 1", "topology": "star", "epoch": 3,
        "generation": 120, "generations": 1000, "evaluations": 12_000, "best": 0.431,
        "uptime": 75.0, "workers": workers, **fields,
    }  # fmt: skip


def heartbeat(seat, uptime):
    links = tuple(
        LinkCounters(seat, other, round(uptime * 50), round(uptime * 90_000))
        for other in ((1, 2, 3) if seat == 0 else (0,))
    )
    stats = Stats(
        seat, seat, "busy", uptime, 0.7 * uptime, 0.05 * uptime, round(1000 * uptime), 10, 1, 0,
        links, 4000 + seat, HOSTILE, (TagCounters("evaluate", 480, 9600, 0, 0),),
    )  # fmt: skip
    return encode(Header(source=seat), stats)


def snapshot(n_workers=3, sniffed=True, **fields):
    inspector, sniffer = Inspector(), Sniffer()
    for seat in range(n_workers + 1):
        for uptime in (10.0, 11.0):
            inspector.take(heartbeat(seat, uptime))
    for sequence in (0, 1, 5):
        sniffer.take(Keys("tramnet").link(0, 1), encode(Header(sequence=sequence), Stop("x")))
    return take(status(n_workers, **fields), inspector, sniffer if sniffed else None)


def lines(shown, view=ALL, width=100, height=None, note=""):
    console = Console(width=width, file=io.StringIO(), highlight=False)
    console.print(render(shown, view, width, height, note))
    return console.file.getvalue().splitlines()


def test_the_view_tells_of_the_run_the_trams_the_links_and_the_messages():
    text = "\n".join(lines(snapshot(), width=120))

    for word in (
        "puma560 case 1", "star (virtual)", "3 workers", "generation 120/1,000", "best 0.431",
        "3,000 evaluations/s", "link/0/1", "link/3/0", "70%", "25%", "evaluate", "from root", "4.00",
        "3 frames seen", "3 missed", "nothing malformed",
    ):  # fmt: skip
        assert word in text


def test_what_the_root_counted_and_dropped_is_told():
    shown = snapshot(
        malformed=1,
        foreign=2,
        over_credit=3,
        refused=4,
        dropped={"late": 5, "unknown_work": 1},
        lost=6,
    )

    text = " ".join(lines(shown, width=200))

    for word in (
        "malformed 1", "foreign 2", "over credit 3", "refused joiners 4", "6 lost",
        "dropped answers 6 (late 5, unknown work 1)",
    ):  # fmt: skip
        assert word in text


@pytest.mark.parametrize("width", [40, 80, 100, 132, 200])
@pytest.mark.parametrize("n_workers", [0, 3])
def test_no_line_is_longer_than_the_terminal_is_wide(width, n_workers):
    assert max(map(cell_len, lines(snapshot(n_workers), width=width))) <= width


@pytest.mark.parametrize("height", [20, 24, 50])
def test_the_live_view_fits_the_height_and_says_what_is_not_shown(height):
    view = View(("trams", "links"))

    shown = lines(snapshot(30), view, width=80, height=height, note="silent")

    assert len(shown) <= height
    assert "silent" in shown
    assert sum("more: ↑↓" in line for line in shown) == 2
    assert shown[-1].startswith("q quit")


def test_scrolling_ends_with_the_last_row():
    view = View(("trams",), offset=1000)

    shown = lines(snapshot(30), view, width=80, height=20)

    assert any(line.split()[:1] == ["30"] for line in shown)


def test_names_from_elsewhere_steer_neither_the_terminal_nor_the_markup():
    text = "\n".join(lines(snapshot(title=HOSTILE), width=160))

    assert "\x1b" not in text
    assert "[red]�[2Jhost[/red]" in text


def test_a_filter_that_nothing_passes_says_so():
    view = View(("trams", "links"), Selection(parse_filter("nobody")), "nobody")

    text = "\n".join(lines(snapshot(), view))

    assert "no TRAM passes the filter" in text
    assert "no link passes the filter" in text


def test_the_column_sorted_by_is_marked_and_the_foot_tells_what_is_typed():
    view = View(("trams",), Selection(sort="busy"))

    assert any("▼busy" in line for line in lines(snapshot(), view, height=30))
    assert "filter: ab▏" in lines(snapshot(), _typed("ab"), height=30)[-1]


def _typed(text):
    view = View(("trams",))
    for key in ("/", *text):
        view = press(view, key)
    return view


def test_a_worker_that_is_not_heard_yet_is_there_already():
    said = status(2)
    said["workers"][1]["live"] = False

    shown = take(said, Inspector(), None)

    assert [(row.seat, row.state) for row in shown.trams] == [(1, "live"), (2, "building")]


@pytest.mark.parametrize("said", [{"generation": "many"}, {"workers": 3}, {"best": []}])
def test_a_status_that_cannot_be_is_refused(said):
    with pytest.raises(RunFailed, match="status"):
        take(said, Inspector(), None)


def test_programs_get_all_tables_and_what_the_root_said():
    found = json.loads(json_line(document(snapshot(), Selection(), 1.5)))

    assert found["time_s"] == 1.5
    assert found["best"] == 0.431
    assert [row["seat"] for row in found["trams"]] == [0, 1, 2, 3]
    assert {row["link"] for row in found["links"]} >= {"link/0/1", "link/2/0"}
    assert found["topics"][0]["missed"] == 3
    assert found["sniffing"]["frames"] == 3


def test_rows_become_csv_with_the_names_of_programs():
    text = csv_lines(snapshot().links, LinkRow, 1.5, head=True)

    (first, *_) = csv.DictReader(io.StringIO(text))
    assert first["time_s"] == "1.500"
    assert first["link"] == "link/0/1"
    assert float(first["bytes_per_s"]) == 90_000.0


def test_a_picture_of_the_view_loads_nothing_from_elsewhere(tmp_path):
    write_picture(tmp_path / "a.svg", render(snapshot(), ALL, 100), 100)

    text = (tmp_path / "a.svg").read_text()
    assert "link/0/1" in text
    assert "url(" not in text.replace("url(#", "")
    assert "http" not in text.replace("http://www.w3.org/", "").replace(
        "https://www.textualize.io", ""
    )
