"""The turbulence against the specification: spectra, variances, stationarity, and the signs of its rotation."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import welch

import aircraft
from autopilot.laws import law
from harness.checks import problems
from harness.doctor.self_tests import wind_triangle_error
from harness.flight import Flight, air_of
from harness.loop import simulate
from harness.plants.model import load, write
from harness.plants.plant import End, Outcome, Start
from harness.plants.sixdof import SixDof, engage, trim
from harness.world.air import Air, Array
from harness.world.randomness import stream
from harness.world.turbulence import FOOT, Dryden, _gradient, dryden, lag_chain, turbulence
from harness.world.wind import SEVERITIES, Wind
from tests.builders import DOCS

MODERATE = dryden("moderate", 13.0, 150.0)
SPAN = 1.27
PLANTS = ("kinematic", "lagged", "coordinated", "sixdof")
FLIGHT = Flight(plant="sixdof", law=law("smc"), duration=10.0, wind=Wind(turbulence="moderate", steady=(2.0, -1.0)))
BANDS = np.geomspace(0.05, 10.0, 9)  # rad/s
SPECTRA: dict[str, Callable[[Dryden, Array], Array]] = {
    "u": Dryden.along,
    "v": Dryden.across,
    "w": Dryden.vertical,
    "p": lambda model, omega: model.roll(omega, SPAN),
    "q": lambda model, omega: model.pitch(omega, SPAN),
    "r": lambda model, omega: model.yaw(omega, SPAN),
}


def one(seed: int, step: float, seconds: float, model: Dryden = MODERATE) -> dict[str, Array]:
    """A realisation with the mean wind, and the flight, to the north: so r is its eastern part."""
    field = turbulence(model, 0.0, seed, step, round(seconds / step))
    u, v, w = field.velocity[field.lead :].T
    p, q, _, r = field.rotation(SPAN).T
    return {"u": u, "v": v, "w": w, "p": p, "q": q, "r": r}


def test_lengths_and_intensities_are_those_of_the_standard() -> None:
    """MIL-F-8785C, Fig. 10 and 11, at 500 ft: L_w = h, L_u = 1002 ft; sigma_w = 0.1 W20, sigma_u = 1.234 sigma_w."""
    model = dryden("severe", 20.0, 500.0 * 0.3048)
    assert model.L_w == pytest.approx(500.0 * 0.3048)
    assert model.L_u / 0.3048 == pytest.approx(500.0 / (0.177 + 0.000823 * 500.0) ** 1.2)
    assert model.sigma_w == pytest.approx(4.5 * 0.514444)
    assert model.sigma_u / model.sigma_w == pytest.approx((0.177 + 0.000823 * 500.0) ** -0.4)
    at_1000_ft = dryden("light", 20.0, 304.8)
    assert at_1000_ft.L_u == pytest.approx(304.8)  # isotropic where the low-altitude model ends
    assert at_1000_ft.sigma_u == pytest.approx(at_1000_ft.sigma_w)


@pytest.mark.parametrize("axis", ["u", "v", "w"])
def test_a_spectrum_integrates_to_the_variance(axis: str) -> None:
    variance, _ = quad(lambda omega: float(SPECTRA[axis](MODERATE, np.array(omega))), 0.0, np.inf)
    assert variance == pytest.approx({"u": MODERATE.sigma_u, "v": MODERATE.sigma_u, "w": MODERATE.sigma_w}[axis] ** 2)


@pytest.mark.parametrize("step", [1e-5, 0.005, 0.05, 2.0])
def test_the_discretisation_is_exact(step: float) -> None:
    """Closed forms of two lags in a row: transition, stationary covariance, and that a step leaves this as it is."""
    T = 11.0
    lags = lag_chain(T, 2, step)
    decay = math.exp(-step / T)
    assert lags.transition == pytest.approx(np.array([[decay, 0.0], [decay * step / T, decay]]), rel=1e-12)
    stationary = lags.stationary @ lags.stationary.T
    assert stationary == pytest.approx(np.array([[0.5, 0.25], [0.25, 0.25]]) / T, rel=1e-12)
    added = lags.added @ lags.added.T
    assert lags.transition @ stationary @ lags.transition.T + added == pytest.approx(stationary, rel=1e-12)
    response = (lambda s: math.exp(-s / T) / T, lambda s: s / T * math.exp(-s / T) / T)
    for i, j in ((0, 0), (0, 1), (1, 1)):
        integral, _ = quad(lambda s, i=i, j=j: response[i](s) * response[j](s), 0.0, step, epsabs=0.0, epsrel=1e-12)
        assert added[i, j] == pytest.approx(integral, rel=1e-6)


@pytest.mark.parametrize(("step", "within"), [(0.005, 0.01), (0.05, 0.1)])
@pytest.mark.parametrize("axis", ["u", "v", "w"])
def test_the_sampled_process_has_the_spectrum_of_the_specification(axis: str, step: float, within: float) -> None:
    """Not estimated: the discrete process' own spectrum, from transition and covariance; what differs is aliased."""
    length, sigma = (MODERATE.L_w, MODERATE.sigma_w) if axis == "w" else (MODERATE.L_u, MODERATE.sigma_u)
    T = length / 13.0
    C = np.array([math.sqrt(2.0 * T)] if axis == "u" else [math.sqrt(3.0 * T), math.sqrt(T) - math.sqrt(3.0 * T)])
    lags = lag_chain(T, len(C), step)
    for omega in np.geomspace(0.05, 10.0, 40):
        H = sigma * C @ np.linalg.inv(np.exp(1j * omega * step) * np.eye(len(C)) - lags.transition) @ lags.added
        spectrum = float(np.sum(np.abs(H) ** 2)) * step / math.pi
        assert spectrum == pytest.approx(SPECTRA[axis](MODERATE, np.array(omega)).item(), rel=within)


@lru_cache
def measured(step: float) -> tuple[Array, dict[str, Array], dict[str, float]]:
    """Frequencies in rad/s, spectra per rad/s by Welch, and variances: the mean of some hours of flight."""
    seeds = range(24)
    spectra: dict[str, Array] = {}
    variances: dict[str, float] = {}
    for seed in seeds:
        for axis, values in one(seed, step, 3600.0).items():
            f, per_hertz = welch(values, 1.0 / step, nperseg=round(400.0 / step), detrend=False)
            spectra[axis] = spectra.get(axis, np.zeros(len(f))) + per_hertz / (2.0 * math.pi) / len(seeds)
            variances[axis] = variances.get(axis, 0.0) + float(np.mean(values**2)) / len(seeds)
    return 2.0 * math.pi * f, spectra, variances


@pytest.mark.parametrize("step", [0.02, 0.05])
@pytest.mark.parametrize("axis", SPECTRA)
def test_realisations_have_the_variance_and_the_spectrum_of_the_specification(axis: str, step: float) -> None:
    omega, spectra, variances = measured(step)
    expected = SPECTRA[axis](MODERATE, omega)
    for low, high in pairwise(BANDS):
        inside = (low <= omega) & (omega < high)
        assert spectra[axis][inside].mean() == pytest.approx(expected[inside].mean(), rel=0.1)
    nyquist = math.pi / step
    variance, _ = quad(lambda w: float(SPECTRA[axis](MODERATE, np.array(w))), 0.0, nyquist, limit=500)
    assert variances[axis] == pytest.approx(variance, rel=0.1)


def test_it_is_stationary_from_the_first_sample() -> None:
    """Variances over 2000 seeds, at the start and later; their standard error is 3 %."""
    times = (0, 1, 10, 100)
    flights = [one(seed, 0.025, 2.5) for seed in range(2000)]
    for axis, spectrum in SPECTRA.items():
        variance, _ = quad(lambda w, s=spectrum: s(MODERATE, np.array(w)), 0.0, math.pi / 0.025, limit=500)
        for k in times:
            assert np.mean([f[axis][k] ** 2 for f in flights]) == pytest.approx(variance, rel=0.12), (axis, k)


def test_a_longer_flight_begins_as_a_shorter_one() -> None:
    short, long = (air_of(replace(FLIGHT, duration=t)) for t in (10.0, 20.0))
    assert np.array_equal(long.gusts[:2001], short.gusts)
    assert np.array_equal(long.rotation(SPAN)[:2001], short.rotation(SPAN))


@pytest.mark.parametrize(
    "flight",
    [
        replace(FLIGHT, plant="kinematic"),
        replace(FLIGHT, law=law("nftsm")),
        replace(FLIGHT, guidance_period=0.5),
        replace(FLIGHT, aircraft="skywalker_x8"),
        replace(FLIGHT, start=Start(heading=2.0, position=(0.0, 500.0))),
    ],
    ids=["plant", "law", "guidance period", "airframe", "start"],
)
def test_the_air_is_the_same_whatever_flies_in_it(flight: Flight) -> None:
    other = air_of(flight)
    assert np.array_equal(other.gusts, air_of(FLIGHT).gusts)
    assert np.array_equal(other.rotation(SPAN), air_of(FLIGHT).rotation(SPAN))


def test_seeds_and_purposes_have_nothing_to_do_with_each_other() -> None:
    """Correlations of the noises; 20000 samples: one standard error is 0.007."""
    noises = [stream(seed, "turbulence").standard_normal(20000) for seed in range(3)]
    noises += [stream(0, purpose).standard_normal(20000) for purpose in ("sensor", "turbulence, roll")]
    apart = np.corrcoef(noises) - np.eye(5)
    assert np.abs(apart).max() < 0.03
    u, v, w, p = (one(0, 0.5, 18000.0)[axis] for axis in "uvwp")
    assert np.abs(np.corrcoef([u, v, w, p]) - np.eye(4)).max() < 0.1


def test_the_axes_turn_with_the_mean_wind() -> None:
    north, east, other = (turbulence(MODERATE, towards, 3, 0.05, 100).velocity for towards in (0.0, math.pi / 2, 0.7))
    u, v, w = north.T
    assert east == pytest.approx(np.column_stack([-v, u, w]))
    assert np.hypot(other[:, 0], other[:, 1]) == pytest.approx(np.hypot(u, v))


def test_a_field_that_grows_ahead_turns_the_air_as_a_rigid_rotation_would() -> None:
    """In a rotation about y, -q = dw/dx; about z, r = dv/dx. Flying at V into a slope k, velocities grow by k V t."""
    V, k, t = 13.0, 0.02, 0.005 * np.arange(2000)
    slope = _gradient(np.outer(k * V * t, [1.0]), V, 0.12, 0.005)[:, 0]
    assert slope[-1] == pytest.approx(k)
    field = turbulence(MODERATE, 0.0, 1, 0.005, 4000)
    _, q, _, r_y = field.rotation(SPAN).T
    down, east = field.velocity[field.lead :, 2], field.velocity[field.lead :, 1]
    assert np.corrcoef(q[1:], -np.diff(down))[0, 1] > 0.1
    assert np.corrcoef(r_y[1:], np.diff(east))[0, 1] > 0.1


@pytest.mark.parametrize(("axis", "moment"), [("p", "l"), ("q", "m"), ("r", "n")])
def test_air_that_rotates_acts_as_the_aircraft_rotating_the_other_way(axis: str, moment: str) -> None:
    fdm = load(aircraft.folder("ultra_stick_25e"), 0.005)
    trim(fdm, Start(), Air())

    def moments(of_air: float, of_aircraft: float) -> float:
        fdm[f"gust/{axis}-rad_sec"] = of_air
        fdm[f"ic/{axis}-rad_sec"] = of_aircraft
        fdm.run_ic()
        return float(fdm[f"moments/{moment}-aero-lbsft"])

    none = moments(0.0, 0.0)
    turned = moments(0.1, 0.0)
    assert abs(turned - none) > 1e-3
    assert turned == pytest.approx(moments(0.0, -0.1), abs=1e-12)
    assert none == pytest.approx(moments(0.1, 0.1), abs=1e-12)


@pytest.mark.parametrize("name", aircraft.names())
def test_jsbsim_flies_in_the_turbulence(name: str) -> None:
    start = Start(airspeed=float(aircraft.data(aircraft.folder(name))["envelope"]["V_design"]["v"]), heading=2.0)
    assert wind_triangle_error(aircraft.folder(name), start, air_of(FLIGHT)) < 1e-6


def test_the_aircraft_meets_the_rotation_about_its_own_axes() -> None:
    flying = SixDof(aircraft.folder("ultra_stick_25e"), 0.005, True).start(Start(heading=2.0), air_of(FLIGHT))
    flying.advance(0.1, 1.0)
    p, q, r_x, r_y = air_of(FLIGHT).rotation(1.27)[200]
    yaw = flying.state.yaw
    met = [flying.fdm[f"gust/{axis}-rad_sec"] for axis in "pqr"]
    assert met == pytest.approx([p, q, r_y * math.cos(yaw) - r_x * math.sin(yaw)], rel=1e-2)


@pytest.mark.parametrize("plant", PLANTS)
def test_a_flight_in_turbulence_flown_twice_is_the_same_to_the_last_bit(plant: str) -> None:
    flight = replace(FLIGHT, plant=plant)
    digest = simulate(flight).digest
    assert simulate(flight).digest == digest
    assert simulate(replace(flight, seed=1)).digest != digest
    assert simulate(replace(flight, wind=Wind(steady=(2.0, -1.0)))).digest != digest


@pytest.mark.parametrize("plant", PLANTS)
def test_the_log_shows_the_air_of_the_flight(plant: str) -> None:
    log = simulate(replace(FLIGHT, plant=plant))
    flown = np.column_stack([log["wind_north"], log["wind_east"], log["wind_down"]])
    assert flown == pytest.approx(air_of(FLIGHT).gusts[::10] + np.array((2.0, -1.0, 0.0)), abs=1e-9)


def test_a_start_above_the_models_range_is_refused() -> None:
    (problem,) = problems(replace(FLIGHT, start=Start(altitude=400.0)))
    assert problem.name == "wind.turbulence"
    assert problem.message == "the low-altitude model holds from 3.048 to 304.8 m; the flight starts at 400 m"


def test_jsbsims_own_dryden_filters_have_the_same_spectra() -> None:
    """Independent code: ttTustin of JSBSim, two hours along a north wind (in others it mirrors its axes)."""
    step, omega = 0.02, np.empty(0)
    densities: list[Array] = []
    for seed in range(1, 9):
        fdm = load(aircraft.folder("ultra_stick_25e"), step)
        start = Start(heading=0.0)
        engage(fdm, trim(fdm, start, Air(steady=(2.0, 0.0))), start, rate_trim=True)
        write(fdm, "simulation/randomseed", seed)
        write(fdm, "atmosphere/turb-type", 4)
        write(fdm, "atmosphere/turbulence/milspec/windspeed_at_20ft_AGL-fps", SEVERITIES["moderate"] / FOOT)
        write(fdm, "atmosphere/turbulence/milspec/severity", 4)
        names = *(f"atmosphere/turb-{axis}-fps" for axis in ("north", "east", "down")), "atmosphere/q-turb-rad_sec"
        table = np.empty((round(900.0 / step), len(names)))
        for row in table:
            fdm.run()
            row[:] = [fdm[name] for name in names]
        hertz, density = welch(table[3000:].T, 1.0 / step, nperseg=5000, detrend=False)  # it starts from rest
        omega, densities = 2.0 * math.pi * hertz, [*densities, density / (2.0 * math.pi)]
    flown = np.mean(densities, axis=0)
    for axis, spectrum, si in zip("uvwq", flown, (FOOT, FOOT, FOOT, 1.0), strict=True):
        for low, high in pairwise((0.5, 1.0, 2.0, 5.0, 10.0)):
            inside = (low <= omega) & (omega < high)
            expected = SPECTRA[axis](MODERATE, omega[inside]).mean()
            assert si**2 * spectrum[inside].mean() == pytest.approx(expected, rel=0.12), (axis, low)


@pytest.mark.parametrize(("name", "airspeed"), [("ultra_stick_25e", 13.0), ("skywalker_x8", 13.0), ("aerosonde", 25.0)])
def test_an_airframe_survives_moderate_turbulence(name: str, airspeed: float) -> None:
    """A small part of `make turbulence`: docs/answers/turbulence.md has 200 flights of 300 s."""
    flight = Flight(
        plant="sixdof",
        aircraft=name,
        law=law("nftsm", "fitted", max_heading_rate=math.radians(10.0), standoff=200.0 * airspeed / 13.0),
        start=Start(airspeed=airspeed),
        wind=Wind(turbulence="moderate"),
        duration=40.0,
    )
    ends = [simulate(replace(flight, seed=seed)).outcome for seed in range(10)]
    assert ends.count(Outcome.COMPLETED) == 10


def test_the_document_has_200_flights_of_each_airframe_in_moderate_turbulence_and_95_percent_survive() -> None:
    """What `make turbulence` flew last; once it found no place for its table and said nothing."""
    text = (DOCS / "answers" / "turbulence.md").read_text(encoding="utf-8")
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("| moderate | ")]
    assert sorted(row[1].split(",")[0] for row in rows) == ["aerosonde", "skywalker_x8", "ultra_stick_25e"]
    for row in rows:
        flights, completed, ground, departed = map(int, row[2:6])
        assert flights == 200 == completed + ground + departed
        assert completed >= 0.95 * flights


def test_it_is_the_limit_of_the_angle_of_attack_that_saves_the_ultra_stick() -> None:
    def stalls(limit: float) -> int:
        lost = 0
        for seed in range(12):
            air = air_of(replace(FLIGHT, aircraft="ultra_stick_25e", seed=seed))
            flying = SixDof(aircraft.folder("ultra_stick_25e"), 0.005, True).start(Start(), air)
            flying.fdm["inner-loop/limit/angle-of-attack-rad"] = limit
            try:
                flying.advance(0.0, 0.05)
                for _ in range(100):
                    flying.advance(0.1, 0.05)
            except End:
                lost += 1
        return lost

    assert stalls(1.0) >= 1
    assert stalls(0.21) == 0


def test_the_sign_of_a_wind_of_zero_changes_nothing() -> None:
    """Of equal winds the air is made once, whichever of them comes first."""
    short, long = (
        Wind(steady=(zero, 0.0), turbulence="moderate")
        .start(airspeed=13.0, altitude=150.0, step=0.005, duration=duration, seed=5)
        .gusts
        for zero, duration in ((0.0, 7.0), (-0.0, 8.0))
    )
    assert np.array_equal(short, long[: len(short)])
