"""`harness predict`: the limit cycle of a law behind an airframe's inner loop."""

from pathlib import Path

import click

from harness.cli._paths import PATH
from harness.cli._setting import SETTING


@click.command()
@click.argument("file", type=PATH)
@click.option(
    "--set", "overrides", multiple=True, type=SETTING, metavar="KEY=VALUE", help="Override a setting; repeatable."
)
def predict(file: Path, overrides: tuple[str, ...]) -> None:
    """Predict the limit cycle of a flight without flying it.

    The flight is the one that FILE describes, on its circle in still air, behind the identified inner loop of its
    airframe. Prints the frequency and the amplitudes of the limit cycle; for NFTSM also how fast the inner loop must
    be for these gains, and the highest gains that this inner loop bears, without a limit cycle.

    \b
    Example:
      harness predict experiments/stationary.toml --set aircraft=skywalker_x8
    """
    import math
    from dataclasses import replace

    from autopilot.nftsm import Nftsm
    from autopilot.response import critical_gain
    from harness.checks import airframe_of
    from harness.cli._input import BadInput, flight_of, read_file
    from harness.limit_cycle.margin import ENOUGH, following
    from harness.limit_cycle.predicted import unforeseen
    from harness.limit_cycle.prediction import Loop, boundary
    from harness.plants.identified import IdentifiedError, identified

    settings = read_file(file, overrides)
    flight = flight_of(settings)
    try:
        one = identified(airframe_of(flight.aircraft), flight.start.airspeed)
    except IdentifiedError as error:
        raise BadInput(f"{settings.locate('start.airspeed')}: {error}") from None
    law = flight.law
    loop = Loop(law, one.heading_rate, flight.start.airspeed, flight.guidance_period)
    found = following(flight)
    if loop.law.max_heading_rate <= abs(loop.turn):
        raise BadInput(f"{settings.locate('law.max_heading_rate')}: {found.reason}")
    if reason := unforeseen(flight):
        click.echo(f"warning: {reason}", err=True)
    bandwidth = loop.response.bandwidth
    click.echo(
        f"{flight.aircraft} at {flight.start.airspeed:g} m/s: bandwidth {bandwidth:.3g} rad/s, "
        f"critical gain {critical_gain(loop.response, loop.period)[0]:.3g} 1/s with a command held {loop.period:g} s"
    )
    cycle = found.cycle
    if found.reason:
        click.echo(f"unknown: {found.reason}")
    elif cycle is None:
        click.echo("no limit cycle: the command oscillates by less than 0.5 deg/s")
    elif not cycle.is_known:
        click.echo("limit cycle: there is one; of a law with memory its frequency and size are not predicted")
    else:
        click.echo(
            f"limit cycle: {cycle.frequency:.3g} Hz, heading rate ±{math.degrees(cycle.heading_rate):.3g} deg/s, "
            f"command ±{math.degrees(cycle.command):.3g} deg/s, range error "
            f"{cycle.range_mean:.3g} ±{cycle.range_error:.3g} m"
        )
    if found.crossover and found.crossover_gain and found.crossover_delay and found.phase_margin is not None:
        click.echo(
            f"crossover of law and inner loop: {found.crossover:.3g} rad/s, where the heading rate is "
            f"{found.crossover_gain:.3g} of its command and {found.crossover_delay:.3g} s late "
            f"({found.low_frequency_gain:.3g} of it at low frequency); phase margin "
            f"{math.degrees(found.phase_margin):.0f} deg"
        )
    if found.margin is not None:
        click.echo(f"margin to the limit cycle: {found.margin:.3g} times the law's gain ({ENOUGH:g} or more is asked)")
    if type(law) is Nftsm:
        quicker = boundary(lambda q: replace(loop, response=loop.response.quicker(q)), 4.0)
        gains = boundary(lambda q: replace(loop, law=replace(law, k2=q * law.k2, k3=q * law.k3)), 0.3)
        if math.isfinite(quicker):
            click.echo(
                f"these gains need an inner loop {quicker:.3g} times as fast to have none: bandwidth "
                f"{quicker * bandwidth:.3g} rad/s"
            )
        if math.isfinite(gains):
            click.echo(
                f"this inner loop has none up to gains of k2 = {gains * law.k2:.3g}, k3 = {gains * law.k3:.3g} 1/s"
            )
