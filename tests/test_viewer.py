"""The real viewer, without a window: it shows what is recorded and what is streamed, and reports nothing amiss."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from numpy.lib.stride_tricks import sliding_window_view
from PIL import Image
from rerun.experimental import ViewerClient

from autopilot.estimator import Estimator
from autopilot.laws import law
from harness.flight import Flight
from harness.log import FlightLog
from harness.loop import simulate
from harness.review.live import Live
from harness.review.recording import write_recording
from harness.review.screenshots import shoot
from harness.review.viewer import ViewerError, free_port, headless, listening, quiet
from harness.settings import flight_from_document
from harness.world.target import Target
from harness.world.wind import Gust, Wind
from tests.builders import command, drawing

TABS = 6
FAST_LAW = {"name": "nftsm", "gains": "fitted", "max_heading_rate_deg_s": 10.0, "standoff_m": "15.4 s"}


def flight(plant: str, gains: str = "paper_1", kind: Literal["truth", "ekf"] = "ekf", duration: float = 20.0) -> Flight:
    gust = Gust(from_=8.0, to=12.0, velocity=(0.0, 3.0, 1.0))
    return Flight(
        plant=plant,
        law=law("nftsm", gains),
        duration=duration,
        wind=Wind(steady=(1.0, 0.5), gusts=(gust,)),
        target=Target(speed=1.0),
        estimator=Estimator(kind=kind),
    )


@pytest.fixture(scope="module")
def six() -> dict[str, FlightLog]:
    """Both plants under three sets of gains; the first two are a pair."""
    return {
        f"{plant} {gains}": simulate(flight(plant, gains))
        for gains in ("paper_1", "paper", "fitted")
        for plant in ("kinematic", "sixdof")
    }


@pytest.fixture
def live() -> Iterator[tuple[ViewerClient, int]]:
    port = free_port()
    with headless(None, port) as client:
        yield client, port


def amiss(client: ViewerClient) -> list[str]:
    reports = [f"{view.name}: {report.summary}" for view in client.get_state().views for report in view.reports]
    return reports + [entry.message for entry in client.get_logs() if entry.level == "ERROR"]


@drawing
@pytest.mark.parametrize(("first", "last"), [(1, 2), (0, 2), (0, 6)])
def test_every_tab_is_drawn_at_several_times_without_a_report(
    first: int, last: int, six: dict[str, FlightLog], tmp_path: Path
) -> None:
    path = tmp_path / "a.rrd"
    write_recording(path, dict(list(six.items())[first:last]), "Flights", "*notes*", "harness view")
    with headless(path) as client:
        layout = client.get_blueprint().blueprint
        (tabs,) = (
            entity["ContainerBlueprint"]
            for entity in layout.values()
            if entity.get("ContainerBlueprint", {}).get("container_kind") == "Tabs"
        )
        assert len(tabs["contents"]) == TABS + (last - first == 2)  # two flights have their differences
        for tab in tabs["contents"]:
            tabs["active_tab"] = tab
            client.set_blueprint(layout, of="recording")
            for at in (0.0, 10.0, 20.0) if tab == tabs["contents"][0] else (10.0,):
                client.set_time("sim_time", duration=at, play_state="paused")
                client.save_screenshot(str(tmp_path / "shot.png"))  # draws, and so reports
                assert amiss(client) == []
        assert (tmp_path / "shot.png").stat().st_size > 20_000  # bytes: more than an empty window has


@drawing
def test_the_time_axes_of_stacked_plots_line_up_at_25_m_s(tmp_path: Path) -> None:
    """The cursor, a white line, is at one place in all of them; their labels differ in width."""
    fast = {"plant": "sixdof", "aircraft": "aerosonde", "duration_s": 70.0, "law": FAST_LAW}
    path, shot = tmp_path / "a.rrd", tmp_path / "shot.png"
    write_recording(path, {"sixdof": simulate(flight_from_document(fast))}, "Fast")
    with headless(path) as client:
        for tab, most in (("overview", 4), ("cursor", 10)):  # points; around the cursor some axes follow the values
            shoot(client, tab, 60.0, shot)
            with Image.open(shot) as picture:
                pixels = np.asarray(picture.convert("RGB"), float)[60:960, 660:]
            white = (pixels.min(axis=2) > 100) & (np.ptp(pixels, axis=2) < 6)
            upright = sliding_window_view(white, 30, axis=0).min(axis=2)
            places = np.flatnonzero(upright.max(axis=0))
            assert np.count_nonzero(upright) > 250  # there is a cursor in several plots
            assert np.ptp(places) <= most, tab


@drawing
def test_a_flight_is_in_the_viewer_while_it_is_flown(live: tuple[ViewerClient, int], tmp_path: Path) -> None:
    client, port = live
    one = flight("sixdof", duration=30.0)
    shown_at = []

    def end_of_data() -> float:
        recordings = client.get_state().recordings
        return max((float(line.end) for r in recordings for line in r.timelines if line.end), default=0.0) / 1e9

    stream = Live("sixdof", "Live", pace=15.0, port=port)

    def watch(at: float, so_far: Callable[[], FlightLog]) -> None:
        stream(at, so_far)
        if at == 20.0:
            shown_at.append(end_of_data())

    log = simulate(one, watch)
    stream.finish(log, "harness fly")
    assert log.digest == simulate(one).digest
    assert 5.0 < shown_at[0] <= 20.0
    deadline = time.monotonic() + 10.0
    while end_of_data() < 30.0 and time.monotonic() < deadline:
        time.sleep(0.05)
    assert end_of_data() == 30.0
    client.save_screenshot(str(tmp_path / "shot.png"))
    assert amiss(client) == []
    assert not stream.gone


@drawing
def test_a_viewer_that_is_closed_does_not_stop_the_flight() -> None:
    port = free_port()
    with headless(None, port):
        stream = Live("kinematic", "Live", pace=1000.0, port=port)
    log = simulate(flight("kinematic", kind="truth"), stream)
    stream.finish(log, "")
    assert stream.gone
    assert log.outcome.value == "completed"


def test_without_a_viewer_a_live_flight_fails_at_once() -> None:
    port = free_port()
    done = command("fly", "experiments/stationary.toml", "--live", "--port", port)
    assert done.returncode == 2
    assert f"no viewer listens on port {port}: open one with `harness view` in another terminal" in done.stderr
    assert done.stdout == ""
    begin = time.monotonic()
    with pytest.raises(ViewerError):
        Live("a", "b", 1.0, port)
    assert time.monotonic() - begin < 1.0


@drawing
def test_a_pace_is_held() -> None:
    """Seconds on the clock: those of the flight by the pace."""
    with headless(None, port := free_port()):
        stream = Live("kinematic", "Live", pace=10.0, port=port)
        begin = time.monotonic()
        log = simulate(flight("kinematic", kind="truth", duration=10.0), stream)
        lasted = time.monotonic() - begin
        stream.finish(log, "")
    assert 1.0 <= lasted < 3.0


@drawing
def test_the_viewer_is_quiet_and_on_loopback(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It writes nothing down in a new home, and nobody else can reach it."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_CONFIG_HOME", raising=False)
    monkeypatch.delenv("CI", raising=False)
    assert quiet()["CI"]
    with headless(None, port := free_port()):
        assert listening(port)
        if Path("/proc/net/tcp").exists():
            opened = [line.split()[1] for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
            assert [where for where in opened if where.endswith(f":{port:04X}")][:1] == [f"0100007F:{port:04X}"]
            assert f"00000000:{port:04X}" not in opened
    assert not list(tmp_path.rglob("analytics.json"))
