"""Adoption: a JSBSim model that nobody here wrote gets an inner loop and flies, or is refused for its true cause."""

import json
import math
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import aircraft
from harness import loop
from harness.adoption import adopt as adopting
from harness.adoption import stages as of_adoption
from harness.adoption.adoption import Adoption, Wish
from harness.adoption.adoption import write as write_files
from harness.adoption.model import named, source
from harness.adoption.refusal import RefusalError
from harness.adoption.stages import STAGES
from harness.flight import air_of
from harness.plants.identified import identified, is_stale
from harness.plants.model import data_root
from harness.settings import load_flight
from harness.studies.adopted_law import FACTORS, Aircraft, LastLap
from harness.studies.design_rule import by_hand, open_loop, page
from harness.world.wind import Gust
from tests.builders import EXPERIMENTS, FLIGHT, HERE, fly_matrix, invoke, write


@pytest.fixture(scope="module")
def adopted(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """What `harness adopt c172p` says, and the folder that it writes."""
    out = tmp_path_factory.mktemp("adopted")
    said = invoke("adopt", "c172p", "--out", out)
    assert said.exit_code == 0, said.output
    return said.output, out / "c172p"


def test_an_aircraft_is_adopted_stage_by_stage_and_its_motion_is_that_of_a_cessna_172(
    adopted: tuple[str, Path],
) -> None:
    said, folder = adopted
    stages = ["guard", "load", "engine", "controls", "trim", "linearise", "design", "90 deg", "circle", "identify"]
    assert [line for line in stages if f"\n{line:<10} " in f"\n{said}"] == stages
    limits, motion = aircraft.limits(folder), aircraft.data(folder)["adopted"]["motion"]
    assert limits.design_airspeed == pytest.approx(43.1, abs=0.5)
    assert motion["roll_time"] == pytest.approx(0.18, abs=0.02)
    assert motion["dutch_roll"] == pytest.approx(2.0, abs=0.1)
    assert motion["dutch_roll_damping"] == pytest.approx(0.20, abs=0.03)


def test_an_adopted_aircraft_flies_the_experiment_that_was_written_for_it(adopted: tuple[str, Path]) -> None:
    _, folder = adopted
    flown = invoke("fly", folder / "circle.toml", "--json")
    assert flown.exit_code == 0, flown.output
    flight = load_flight(folder / "circle.toml")
    metrics = json.loads(flown.stdout)["metrics"]
    assert metrics["range_error_rms_m"] < 0.015 * flight.law.standoff
    assert metrics["altitude_deviation_peak_m"] < 15.0
    assert metrics["sideslip_peak_deg"] < 6.0
    assert metrics["bank_peak_deg"] < math.degrees(aircraft.limits(folder).bank)


@pytest.mark.parametrize("name", ["ultra_stick_25e", "c172p"])
def test_a_gust_meets_an_airframe_of_ours_and_an_adopted_one_at_its_own_time(
    name: str, adopted: tuple[str, Path]
) -> None:
    one = load_flight(adopted[1] / "circle.toml")
    if name != "c172p":
        one = replace(FLIGHT, plant="sixdof", aircraft=name)
    gust = Gust(from_=0.0, to=1.0, velocity=(3.0, -2.0, 0.0))
    one = replace(one, duration=0.5, wind=replace(one.wind, gusts=(gust,)))
    log, air = loop.simulate(one), air_of(one)
    steps = round(one.guidance_period / one.step)
    wind = [air.horizontal(k * steps) for k in range(len(log))]
    assert np.column_stack([log["wind_north"], log["wind_east"]]) == pytest.approx(np.array(wind), abs=1e-9)


def test_the_course_rate_is_the_commanded_one_and_a_step_winds_nothing_up(adopted: tuple[str, Path]) -> None:
    flown, follows = (aircraft.data(adopted[1])["adopted"][name] for name in ("flown", "follows"))
    assert flown["turn"]["rate"] == pytest.approx(1.0, abs=0.05)
    assert flown["turn"]["sideslip"] < math.radians(0.5)
    assert follows["gain"] == pytest.approx(1.0, abs=0.01)
    assert follows["overshoot"] < 0.06


def test_an_aircraft_of_an_earlier_adoption_that_lacks_its_lag_is_not_identified_but_told(
    adopted: tuple[str, Path], tmp_path: Path
) -> None:
    folder = shutil.copytree(adopted[1], tmp_path / "c172p")
    data = (folder / "airframe.toml").read_text(encoding="utf-8")
    write(folder / "airframe.toml", data.replace("\nlag = ", "\nlead = "))
    aircraft.keep_written(folder)
    said = invoke("identify", folder, "--out", tmp_path / "plots")
    assert said.exit_code == 2
    assert "adopted.loop.lag must be a number above 0: run `harness adopt` again" in said.output


def test_the_experiment_of_adopted_aircraft_flies_with_one_of_them_beside_the_three_of_the_harness(
    adopted: tuple[str, Path], tmp_path: Path
) -> None:
    shutil.copytree(adopted[1], tmp_path / "out" / "adopted" / "c172p")
    text = (EXPERIMENTS / "adopted.toml").read_text(encoding="utf-8")
    there = [line for line in text.splitlines() if "adopted/T38" not in line and "adopted/dr1" not in line]
    (tmp_path / "experiments").mkdir()
    file = write(tmp_path / "experiments" / "adopted.toml", "\n".join(there))
    progress = fly_matrix(file, tmp_path / "run", "guidance_period_s=0.5", "duration_s=2.0", options=HERE)
    assert (progress.failed, progress.done) == (0, 16)


def aircraft_whose_command_rests_up_to(factor: float) -> Aircraft:
    quiet, loud = LastLap("", 0.0, 0.0, 0.0), LastLap("", math.radians(1.0), 0.2, 0.01)
    ladder = [quiet if each <= factor else loud for each in FACTORS]
    return Aircraft("one", 10.0, 100.0, 1.0, border=2.0, ladder=ladder, judged=[])


def test_the_limit_cycle_begins_between_the_last_gain_that_rests_and_the_first_that_does_not() -> None:
    assert aircraft_whose_command_rests_up_to(0.8).begins == (0.8, 0.9)
    assert aircraft_whose_command_rests_up_to(0.8).mistold == [0.9]
    assert aircraft_whose_command_rests_up_to(0.1).begins == (0.0, FACTORS[0])
    assert aircraft_whose_command_rests_up_to(9.0).begins == (FACTORS[-1], math.inf)
    assert aircraft_whose_command_rests_up_to(9.0).mistold == [1.1, 1.25, 1.5]


@pytest.mark.parametrize("name", aircraft.names())
def test_an_airframe_without_its_inner_loop_is_a_model_of_its_own(name: str, tmp_path: Path) -> None:
    folder = tmp_path / name
    folder.mkdir()
    model = source(str(write(folder / f"{name}.xml", open_loop(aircraft.folder(name)))))
    assert not any(each.startswith(("inner-loop/", "actuators/")) for each in named(model.root))
    assert "fcs/aileron-cmd-norm" in named(model.root)


def test_gains_that_are_no_better_are_told_so() -> None:
    hand = by_hand(aircraft.folder("ultra_stick_25e"))
    assert "No: with the rule's gains 0 of 1 airframes follow sooner" in page([hand, hand._replace(made="by the rule")])


def test_an_adopted_model_is_one_file_and_names_what_it_was_made_of(adopted: tuple[str, Path]) -> None:
    _, folder = adopted
    assert {file.name for file in folder.iterdir()} == {
        "airframe.toml", "circle.toml", "c172p.xml", "identified.toml", "inner_loop.toml", "written.toml",
    }  # fmt: skip
    assert list(aircraft.data(folder)["adopted"]["sources"]) == ["c172p.xml", "eng_io320.xml", "prop_75in2f.xml"]


def test_an_adopted_aircraft_is_identified_flown_on_the_plants_between_and_predicted(
    adopted: tuple[str, Path],
) -> None:
    folder = adopted[1]
    assert not is_stale(folder)
    follows = aircraft.data(folder)["adopted"]["follows"]
    assert follows["lag_s"] == pytest.approx(identified(folder, 43.1).measured["lag_s"], rel=1e-3)
    for plant in ("lagged", "coordinated"):
        flown = invoke("fly", folder / "circle.toml", "--set", f"plant={plant}", "--json")
        assert flown.exit_code == 0, flown.output
        assert json.loads(flown.stdout)["metrics"]["convergence_time_s"] > 0.0
    predicted = invoke("predict", folder / "circle.toml")
    assert predicted.exit_code == 0, predicted.output
    assert "margin" in predicted.output


def test_what_adopt_identifies_is_what_identify_does(adopted: tuple[str, Path], tmp_path: Path) -> None:
    folder = shutil.copytree(adopted[1], tmp_path / "c172p")
    aircraft.identified(folder).unlink()
    said = invoke("identify", folder, "--keep", "--out", tmp_path / "plots")
    assert said.exit_code == 0, said.output
    assert aircraft.identified(folder).read_bytes() == aircraft.identified(adopted[1]).read_bytes()


def not_identified(adoption: Adoption) -> tuple[Adoption, str]:
    raise RefusalError("identify", "a manoeuvre ended in departed: bank of 80 deg")


def test_an_aircraft_that_is_not_identified_is_adopted_without_the_plants_between(
    adopted: tuple[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = shutil.copytree(adopted[1], tmp_path / "c172p")
    monkeypatch.setattr(adopting, "identifying", not_identified)
    said = invoke("adopt", "c172p", "--out", tmp_path)
    assert said.exit_code == 0, said.output
    assert "identify   without lagged and coordinated: a manoeuvre ended in departed: bank of 80 deg\n" in said.output
    assert not aircraft.identified(folder).exists()
    flown = invoke("fly", folder / "circle.toml", "--set", "plant=lagged")
    assert flown.exit_code == 2
    assert "c172p is not identified" in flown.output


@pytest.mark.parametrize(
    ("model", "stage", "cause"),
    [
        ("minisgs", "engine", "no engine"),
        ("F450", "engine", "throttle has no effect: thrust .*; the engines push across the flight, by 59"),
        ("C130", "engine", "throttle has too little effect: .*; a turbine drives a propeller: JSBSim takes its thrust"),
        ("L410", "engine", 'throttle has no effect.*<diameter> 99 without unit="IN" has 99 ft, on a wing of 64.64 ft'),
        ("fokker50", "engine", "throttle has no effect: .*; the torque limiter of engine 0 holds it"),
        ("f22", "controls", "fcs/elevator-cmd-norm moves nothing: .*<integrator name='fcs/pitch-rate-integrator'>"),
        ("B17", "trim", "no level flight .*: short by 0.028 g at full throttle"),
    ],
)
def test_a_model_that_cannot_fly_is_refused_with_its_cause_and_leaves_no_folder(
    model: str, stage: str, cause: str, tmp_path: Path
) -> None:
    said = invoke("adopt", model, "--out", tmp_path / "out")
    assert said.exit_code == 1
    assert re.search(f"^not adopted: {stage}: {cause}", said.output, re.MULTILINE), said.output
    assert not (tmp_path / "out" / model).exists()


def found_up_to(stage: str, model: str, out: Path) -> dict[str, str]:
    """What the stages of an adoption say, up to this one; the later ones are not begun."""
    said = {}
    for each, line in adopting.adopt(model, out, Wish()):
        said[each] = line
        if each == stage:
            break
    return said


def test_engines_that_stand_while_the_fuel_is_frozen_are_started_with_fuel_that_flows(tmp_path: Path) -> None:
    assert found_up_to("trim", "Short_S23", tmp_path)["trim"].startswith("62.9 m/s")


def test_a_model_that_reads_the_cockpit_and_instruments_of_flightgear_is_told_what_jsbsim_knows(tmp_path: Path) -> None:
    said = found_up_to("engine", "p51d", tmp_path)
    assert "3 as in FlightGear" in said["load"]
    assert "thrust 2.93e+03 N at throttle 0.2, 1.29e+04 N at 1" in said["engine"]


def test_an_aircraft_with_strongly_damped_pitching_holds_its_altitude_in_a_turn(tmp_path: Path) -> None:
    said = found_up_to("90 deg", "XB-70", tmp_path)["90 deg"]
    assert float(said.partition("altitude ")[2].partition(" m")[0]) < 20.0


def test_a_rocket_with_empty_tanks_is_filled_refilled_while_it_burns_and_flies(tmp_path: Path) -> None:
    said = found_up_to("90 deg", "X15", tmp_path)
    assert ", empty tanks filled, 14641 kg, " in said["load"]
    assert said["engine"].startswith("1 running, its tanks refilled while it burns, thrust 0 N at throttle 0.2")
    assert "course within 0." in said["90 deg"]


@pytest.mark.parametrize(("model", "because"), [("c172x", "its surfaces have play"), ("Camel", "its rotor is heavy")])
def test_what_moves_late_or_with_play_is_waited_for_in_the_trim(model: str, because: str, tmp_path: Path) -> None:
    left = found_up_to("trim", model, tmp_path)["trim"].rpartition("; ")[2]
    assert float(left.partition(" ")[0]) < 5e-4, because


def test_an_aircraft_whose_rudder_does_nothing_is_trimmed_with_sideslip(tmp_path: Path) -> None:
    said = found_up_to("trim", "wrightFlyer1903", tmp_path)
    assert re.search(r", rudder 0 rad/s\^2|, rudder \S+e-\d+ rad/s\^2", said["controls"])
    assert ", rudder 0.00, sideslip -0.6 deg, " in said["trim"]


def test_an_aircraft_turns_no_steeper_than_its_rudder_holds_and_then_flies(tmp_path: Path) -> None:
    said = found_up_to("90 deg", "Camel", tmp_path)
    assert "turns of 20 deg, for which aileron and rudder suffice" in said["design"]
    assert said["90 deg"]


def refused_below_50(adoption: Adoption) -> tuple[Adoption, str]:
    if adoption.start.airspeed < 50.0:
        raise RefusalError("design", "no bank loop is stable")
    return adoption, "stable"


def test_an_aircraft_that_cannot_be_flown_in_its_first_trim_is_tried_in_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(adopting, "STAGES", {**STAGES, "design": refused_below_50})
    stages = adopting.adopt("c172p", tmp_path, Wish())
    assert ("design", "no bank loop is stable: at another airspeed") in iter(stages)
    assert next(line for stage, line in stages if stage == "trim").startswith("51.")


@pytest.fixture(scope="module")
def altered(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """The same of a c172p whose aileron has a name of its own, and whose rudder goes no further than a tenth."""
    model = (data_root() / "aircraft" / "c172p" / "c172p.xml").read_text(encoding="utf-8")
    model = model.replace("fcs/aileron-cmd-norm", "fcs/my-roll-cmd")
    before, rudder, after = model.partition("<input>fcs/rudder-cmd-norm</input>")
    assert rudder
    after = after.replace("<min>-1</min>", "<min>-0.1</min>", 1).replace("<max>1</max>", "<max>0.1</max>", 1)
    folder = tmp_path_factory.mktemp("altered") / "altered"
    folder.mkdir()
    write(folder / "altered.xml", before + rudder + after)
    for engine in ("eng_io320", "prop_75in2f"):
        shutil.copy(data_root() / "engine" / f"{engine}.xml", folder)
    said = invoke("adopt", folder / "altered.xml", "--out", folder.parent / "out")
    assert said.exit_code == 0, said.output
    return said.output, folder.parent / "out" / "altered"


def test_a_command_without_a_standard_name_is_found_by_what_it_moves(altered: tuple[str, Path]) -> None:
    assert aircraft.data(altered[1])["adopted"]["controls"]["aileron"] == "fcs/my-roll-cmd"


def test_what_stands_between_a_command_and_its_surface_is_told(
    altered: tuple[str, Path], adopted: tuple[str, Path]
) -> None:
    assert "\nlinearise  rudder does -0.82, -0.55, -0.2 rad/s^2 per command of 1, 3 and 8 times the size" in altered[0]
    assert "stands between" not in adopted[0]


def test_a_bare_name_is_a_model_of_jsbsim_whatever_folder_lies_about(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "c172p").mkdir()
    monkeypatch.chdir(tmp_path)
    assert source("c172p").root.get("name") == "c172"


def test_a_mistake_in_a_map_of_controls_is_one_line(tmp_path: Path) -> None:
    controls = write(tmp_path / "controls.toml", "flaps = 1")
    said = invoke("adopt", "c172p", "--controls", controls)
    assert said.exit_code == 2
    assert "flaps is not one of elevator, aileron, rudder, throttle" in said.output


def test_a_control_that_the_model_does_not_have_is_one_line_with_its_place_and_names_like_it(tmp_path: Path) -> None:
    text = 'aileron = "fcs/aileron-cmd-norm"\nthrottle = [\n  "fcs/throttle-cmd-norm",\n  "fcs/throtle-cmd-norm[1]",\n]'
    controls = write(tmp_path / "controls.toml", text)
    said = invoke("adopt", "c172p", "--controls", controls, "--out", tmp_path / "out")
    assert said.exit_code == 2
    place = f"--controls: {controls}:4: throttle: the model has no property fcs/throtle-cmd-norm[1]; like it are "
    assert f"{place}fcs/throttle-cmd-norm, " in said.output


def test_a_model_too_slow_to_fly_is_refused_at_its_load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    model = source("c172p")
    folder = tmp_path / "c172p"
    folder.mkdir()
    adoption = Adoption(name="c172p", wish=Wish(), folder=folder, names=frozenset(named(model.root)), writers={})
    write_files(adoption, model)
    monkeypatch.setattr(of_adoption, "_SLOWEST", 0.0)
    with pytest.raises(RefusalError, match=r"load: a step takes .* ms to compute, may take 0 ms"):
        STAGES["load"](adoption)
    monkeypatch.setattr(adopting, "LOADING", 0.01)
    with pytest.raises(RefusalError, match=r"load: not done after 0\.01 s"):
        found_up_to("load", "c172p", tmp_path / "out")
