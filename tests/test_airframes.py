"""What JSBSim reports of each airframe against what its data imply by the textbook formulas.

Forces and moments: Beard & McLain, Small Unmanned Aircraft, ch. 4; rigid body: Stevens & Lewis, ch. 1. The formulas are
written here a second time on purpose: the models are written from a template.
"""

import math
from pathlib import Path
from typing import Any, NamedTuple

import jsbsim
import numpy as np
import pytest
from numpy.typing import NDArray

import aircraft
from aircraft.write_models import jsbsim_model
from aircraft.write_models import main as write_models
from harness.checks import airframe_of
from harness.plants.model import FT, SLUG, ModelError, load
from harness.plants.plant import Start
from harness.plants.sixdof import NoTrimError, engage, trim
from harness.world.air import Air
from tests.builders import copied_airframe, write

LBF = 4.4482216152605  # N
AIRFRAMES = aircraft.names()
STEP = 0.005
Vector = NDArray[np.float64]


def design_start(name: str, heading: float = 0.4) -> Start:
    return Start(airspeed=aircraft.limits(aircraft.folder(name)).design_airspeed, heading=heading)


class Condition(NamedTuple):
    """Airspeed m/s, angles rad, rates rad/s, surfaces rad, throttle."""

    V: float
    alpha: float
    beta: float
    p: float
    q: float
    r: float
    d_a: float
    d_e: float
    d_r: float
    d_t: float


CONDITIONS = [
    Condition(14.0, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.35),
    Condition(17.0, 0.09, 0.08, 0.3, -0.2, 0.15, 0.1, -0.12, -0.08, 0.62),
    Condition(22.0, -0.04, -0.1, -0.6, 0.4, -0.3, -0.2, 0.07, 0.15, 0.0),
    Condition(12.0, 0.30, 0.05, 0.1, 0.1, 0.1, 0.05, 0.1, 0.02, 1.0),  # about or beyond the stall
    Condition(15.0, -0.35, -0.02, 0.0, 0.0, 0.0, -0.05, -0.2, 0.0, 0.05),
    Condition(24.0, 0.55, 0.2, 0.5, -0.5, 0.5, 0.0, 0.0, 0.0, 0.77),
]


def place(name: str, c: Condition) -> jsbsim.FGFDMExec:
    fdm = load(aircraft.folder(name), STEP)
    u, v, w = velocity(c)
    for key, value in {
        "ic/h-sl-ft": 150.0 / FT, "ic/phi-rad": 0.0, "ic/theta-rad": 0.0, "ic/psi-true-rad": 0.0,
        "ic/u-fps": u / FT, "ic/v-fps": v / FT, "ic/w-fps": w / FT,
        "ic/p-rad_sec": c.p, "ic/q-rad_sec": c.q, "ic/r-rad_sec": c.r, "actuators/engaged": 0.0,
        "fcs/left-aileron-pos-rad": c.d_a, "fcs/elevator-pos-rad": c.d_e, "fcs/rudder-pos-rad": c.d_r,
        "actuators/throttle-norm": c.d_t,
    }.items():  # fmt: skip
        fdm[key] = value
    fdm.run_ic()
    return fdm


def velocity(c: Condition) -> tuple[float, float, float]:
    u = c.V * math.cos(c.alpha) * math.cos(c.beta)
    return u, c.V * math.sin(c.beta), c.V * math.sin(c.alpha) * math.cos(c.beta)


def aerodynamics(data: dict[str, Any], c: Condition, rho: float) -> tuple[Vector, Vector]:
    """Force N and moment N m about the centre of gravity, body axes."""
    k = {name: entry["v"] for name, entry in data["aero"].items() if isinstance(entry, dict)}
    S, b, chord = (data["ref"][x]["v"] for x in ("S", "b", "c"))
    p, q, r = c.p * b / (2 * c.V), c.q * chord / (2 * c.V), c.r * b / (2 * c.V)
    rudder = c.d_r if data["meta"]["has_rudder"] else 0.0
    low, high = (
        math.exp(-k["stall_M"] * (c.alpha - k["alpha_stall"])),
        math.exp(k["stall_M"] * (c.alpha + k["alpha_stall"])),
    )
    stalled = (1 + low + high) / ((1 + low) * (1 + high))
    attached = k["CL0"] + k["CLa"] * c.alpha
    plate = 2 * math.copysign(1.0, c.alpha) * math.sin(c.alpha) ** 2 * math.cos(c.alpha)
    C_L = (1 - stalled) * attached + stalled * plate + k["CLq"] * q + k["CLde"] * c.d_e
    polar = {"polar_total_CL": C_L, "polar_alpha_CL": attached}.get(data["aero"]["drag_model"])
    C_D = k["CD0"] + (k["kD"] * (polar - k["CLminD"]) ** 2 if polar is not None else 0.0)
    C_D += k["CDa1"] * c.alpha + k["CDa2"] * c.alpha**2 + k["CDb1"] * abs(c.beta) + k["CDb2"] * c.beta**2
    C_D += k["CDde_abs"] * abs(c.d_e) + k["CDde2"] * c.d_e**2 + k["CDde_lin"] * c.d_e
    C_D += k["CDda_abs"] * abs(c.d_a) + k["CDdr_abs"] * abs(rudder)

    def lateral(x: str) -> float:
        derivatives = k[x + "b"] * c.beta + k[x + "p"] * p + k[x + "r"] * r + k[x + "da"] * c.d_a + k[x + "dr"] * rudder
        return float(k[x + "0"] + derivatives)

    ca, sa, cb, sb = math.cos(c.alpha), math.sin(c.alpha), math.cos(c.beta), math.sin(c.beta)
    if data["aero"]["force_axes"] == "wind":
        to_body = np.array([[ca * cb, -ca * sb, -sa], [sb, cb, 0.0], [sa * cb, -sa * sb, ca]])
    else:
        to_body = np.array([[ca, 0.0, -sa], [0.0, 1.0, 0.0], [sa, 0.0, ca]])
    q_S = 0.5 * rho * c.V**2 * S
    force = q_S * to_body @ [-C_D, lateral("CY"), -C_L]
    C_m = k["Cm0"] + k["Cma"] * c.alpha + k["Cmq"] * q + k["Cmde"] * c.d_e
    about_reference = q_S * np.array([b * lateral("Cl"), chord * C_m, b * lateral("Cn")])
    offset = data["ref"].get("aero_offset", {"v": [0.0, 0.0, 0.0]})["v"]
    return force, about_reference + np.cross(offset, force)


def thrust(data: dict[str, Any], c: Condition, rho: float) -> tuple[Vector, Vector]:
    """Force N and moment N m about the centre of gravity: the published table, bilinear, scaled with the density."""
    table = data["propulsion"]
    columns = [np.interp(c.V, table["V_grid"], row) for row in table["thrust_table_N"]]
    T = float(np.interp(c.d_t, table["throttle_grid"], columns)) * rho / table["rho_ref"]
    force = np.array([T, 0.0, 0.0])
    return force, np.cross(table.get("thrust_offset", {"v": [0.0, 0.0, 0.0]})["v"], force)


def reported(fdm: jsbsim.FGFDMExec, of: str) -> tuple[Vector, Vector]:
    force = LBF * np.array([fdm[f"forces/fb{x}-{of}-lbs"] for x in "xyz"])
    return force, LBF * FT * np.array([fdm[f"moments/{x}-{of}-lbsft"] for x in "lmn"])


@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("name", AIRFRAMES)
def test_forces_moments_and_accelerations_are_those_of_the_data(name: str, condition: Condition) -> None:
    data = aircraft.data(aircraft.folder(name))
    fdm = place(name, condition)
    rho = SLUG / FT**3 * fdm["atmosphere/rho-slugs_ft3"]
    aero, push = aerodynamics(data, condition, rho), thrust(data, condition, rho)
    for (force, moment), of in ((aero, "aero"), (push, "external")):
        its_force, its_moment = reported(fdm, of)
        assert its_force == pytest.approx(force, rel=1e-6, abs=1e-6)
        assert its_moment == pytest.approx(moment, rel=1e-6, abs=1e-6)

    m = data["mass"]
    J = np.array(
        [[m["Ixx"]["v"], 0.0, -m["Ixz"]["v"]], [0.0, m["Iyy"]["v"], 0.0], [-m["Ixz"]["v"], 0.0, m["Izz"]["v"]]]
    )
    omega = np.array([condition.p, condition.q, condition.r])
    rotation = np.linalg.solve(J, aero[1] + push[1] - np.cross(omega, J @ omega))
    assert [fdm[f"accelerations/{x}dot-rad_sec2"] for x in "pqr"] == pytest.approx(rotation, rel=2e-4, abs=1e-4)
    gravity = np.array([0.0, 0.0, FT * fdm["accelerations/gravity-ft_sec2"]])
    translation = (aero[0] + push[0]) / m["m"]["v"] + gravity - np.cross(omega, velocity(condition))
    assert [FT * fdm[f"accelerations/{x}dot-ft_sec2"] for x in "uvw"] == pytest.approx(translation, rel=1e-5, abs=1e-5)


@pytest.mark.parametrize("name", AIRFRAMES)
def test_mass_and_inertia_are_those_of_the_data(name: str) -> None:
    mass = aircraft.data(aircraft.folder(name))["mass"]
    fdm = place(name, CONDITIONS[0])
    inertia = {x: SLUG * FT**2 * fdm[f"inertia/{x}-slugs_ft2"] for x in ("ixx", "iyy", "izz", "ixz")}
    assert SLUG * fdm["inertia/mass-slugs"] == pytest.approx(mass["m"]["v"], rel=1e-5)
    assert inertia["ixx"] == pytest.approx(mass["Ixx"]["v"], rel=1e-4)
    assert inertia["iyy"] == pytest.approx(mass["Iyy"]["v"], rel=1e-4)
    assert inertia["izz"] == pytest.approx(mass["Izz"]["v"], rel=1e-4)
    assert inertia["ixz"] == pytest.approx(-mass["Ixz"]["v"], rel=1e-4)  # JSBSim reports the tensor's element


@pytest.mark.parametrize("wind", [(0.0, 0.0), (5.0, 0.0), (-5.0, 0.0), (0.0, 5.0), (0.0, -5.0), (-3.0, 4.0)])
@pytest.mark.parametrize("name", AIRFRAMES)
def test_trimmed_flight_has_no_acceleration_once_the_actuators_run(name: str, wind: tuple[float, float]) -> None:
    fdm = load(aircraft.folder(name), STEP)
    start = design_start(name)
    trimmed = trim(fdm, start, Air(steady=wind))
    engage(fdm, trimmed, start, rate_trim=True)
    for _ in range(400):  # 2 s: several times the slowest actuator's lag
        fdm.run()
    assert fdm["fcs/elevator-pos-rad"] == pytest.approx(trimmed.elevator, abs=1e-6)
    assert [FT * fdm[f"accelerations/{x}dot-ft_sec2"] for x in "uvw"] == pytest.approx([0, 0, 0], abs=1e-6)
    assert [fdm[f"accelerations/{x}dot-rad_sec2"] for x in "pqr"] == pytest.approx([0, 0, 0], abs=1e-6)
    assert FT * fdm["velocities/vt-fps"] == pytest.approx(start.airspeed, abs=1e-6)


@pytest.mark.parametrize("name", AIRFRAMES)
def test_models_are_written_from_the_data(name: str) -> None:
    airframe = aircraft.folder(name)
    assert aircraft.model(airframe).read_text(encoding="utf-8") == jsbsim_model(airframe), "run `make models`"


@pytest.mark.parametrize("name", AIRFRAMES)
def test_every_number_of_an_airframe_has_a_source(name: str) -> None:
    def sourceless(table: dict[str, Any], path: str) -> list[str]:
        if "v" in table:
            return [] if table.get("src") else [path]
        return [
            x for key, value in table.items() if isinstance(value, dict) for x in sourceless(value, f"{path}.{key}")
        ]

    data = aircraft.data(aircraft.folder(name))
    judged = {key: data[key] for key in ("mass", "ref", "aero", "actuators", "envelope")}
    assert sourceless(judged, name) == []


@pytest.mark.parametrize(
    ("name", "airspeed"), [("ultra_stick_25e", 7.0), ("ultra_stick_25e", 60.0), ("aerosonde", 9.0)]
)
def test_an_airspeed_beyond_the_airframe_is_refused(name: str, airspeed: float) -> None:
    with pytest.raises(NoTrimError):
        trim(load(aircraft.folder(name), STEP), Start(airspeed=airspeed), Air())


def test_a_folder_laid_out_alike_is_an_airframe(tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    given = aircraft.folder("skywalker_x8")
    (mine / "airframe.toml").write_bytes((given / "airframe.toml").read_bytes())
    (mine / "inner_loop.toml").write_bytes((given / "inner_loop.toml").read_bytes())
    (mine / "mine.xml").write_text(jsbsim_model(mine), encoding="utf-8")
    assert trim(load(aircraft.folder(str(mine)), STEP), design_start("skywalker_x8"), Air()).throttle > 0


def edited(airframe: Path, name: str, before: str, after: str) -> None:
    text = (airframe / name).read_text(encoding="utf-8")
    assert before in text
    write(airframe / name, text.replace(before, after))


@pytest.mark.parametrize("name", ["airframe.toml", "inner_loop.toml"])
@pytest.mark.parametrize("noted", [True, False])
def test_edited_data_are_refused_until_the_model_is_written_from_them_or_kept(
    name: str, noted: bool, tmp_path: Path
) -> None:
    mine = copied_airframe("ultra_stick_25e", tmp_path / "mine")
    if not noted:
        aircraft.written(mine).unlink()
    assert airframe_of(str(mine)) == mine
    data = aircraft.inner_loop(mine)["gain"]
    gain = next(iter(data))
    changes = {
        "airframe.toml": ("m = { v = 1.959", "m = { v = 2.3"),
        "inner_loop.toml": (f"{gain} = {{", f"{gain} ={{"),
    }
    edited(mine, name, *changes[name])
    edited(mine, name, "\n[", "\n# a comment\n[")
    if name == "inner_loop.toml":
        assert not aircraft.is_stale(mine)  # the same numbers, otherwise written
        edited(mine, name, f"{gain} ={{ v = {data[gain]['v']}", f"{gain} = {{ v = {2.0 * data[gain]['v']}")
    again = f"python -m aircraft.write_models {mine}"
    told = f"mine.xml was not written from airframe.toml .* run `{again}`, or `{again} --keep` to fly"
    with pytest.raises(ValueError, match=told):
        airframe_of(str(mine))
    before = load(mine, STEP)
    write_models([str(mine)])
    after = load(airframe_of(str(mine)), STEP)
    of = "inertia/empty-weight-lbs" if name == "airframe.toml" else f"inner-loop/gain/{gain}"
    assert before[of] != after[of]
    edited(mine, "airframe.toml", "alpha_stall", "beta_stall = { v = 0.1 }\nalpha_stall")
    assert aircraft.is_stale(mine)
    model = aircraft.model(mine).read_bytes()
    write_models(["--keep", str(mine)])
    assert airframe_of(str(mine)) == mine
    assert aircraft.model(mine).read_bytes() == model


def test_an_edited_model_is_checked_and_flown(tmp_path: Path) -> None:
    mine = copied_airframe("aerosonde", tmp_path / "mine")
    edited(mine, "mine.xml", '<emptywt unit="KG"> 11', '<emptywt unit="KG"> 12')
    assert SLUG * load(airframe_of(str(mine)), STEP)["inertia/mass-slugs"] != pytest.approx(11.0, abs=0.5)
    edited(mine, "mine.xml", '<emptywt unit="KG"> 12', '<emptywt unit="KG"> -12')
    with pytest.raises(ModelError, match=r"mine\.xml:\d+: <emptywt> is -12"):
        load(mine, STEP)


def test_write_models_writes_what_it_is_told_and_says_what_it_cannot(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    mine = copied_airframe("aerosonde", tmp_path / "a & b")
    aircraft.model(mine).unlink()
    monkeypatch.chdir(tmp_path)
    write_models(["a & b"])
    assert capsys.readouterr().out == f"wrote {aircraft.model(mine)}\n"
    assert load(mine, STEP)["inertia/ixx-slugs_ft2"] == 0.0
    shipped = aircraft.model(aircraft.folder("aerosonde"))
    before = shipped.read_bytes()
    write_models(["aerosonde"])
    assert (capsys.readouterr().out, shipped.read_bytes()) == (f"wrote {shipped}\n", before)
    edited(mine, "airframe.toml", "Ixx", "Ixxx")
    for words, told in ((["a & b"], "has no attribute 'Ixx'"), (["unknown"], "unknown: must be one of aerosonde, ")):
        with pytest.raises(SystemExit, match="2"):
            write_models(words)
        (line,) = capsys.readouterr().err.splitlines()
        assert told in line


def test_an_edit_of_an_adopted_airframe_is_refused_and_its_model_is_not_written_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = copied_airframe("aerosonde", tmp_path / "mine")
    edited(mine, "airframe.toml", "[mass]", "[adopted]\nstep = 0.005\n[mass]")
    write_models(["--keep", str(mine)])
    assert airframe_of(str(mine)) == mine
    edited(mine, "inner_loop.toml", "bank-rad = { v = 0.", "bank-rad = { v = 0.1")
    with pytest.raises(ValueError, match="as they are: run `harness adopt` again, or"):
        airframe_of(str(mine))
    with pytest.raises(SystemExit, match="2"):
        write_models([str(mine)])
    assert "is an adopted model, which `harness adopt` writes" in capsys.readouterr().err
