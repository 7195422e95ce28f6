"""The viewer inside a notebook, by Rerun's notebook support: the extra `notebook` of this package."""

import os
from collections.abc import Mapping
from typing import Any

from harness.log import FlightLog
from harness.review.recorder import Recorder
from harness.review.recording import log_flights

_HEIGHT = 900  # pixels


def viewer(logs: Mapping[str, FlightLog], title: str) -> Any | None:
    """Rerun's viewer with these flights in the layout of their recording, to be shown by a notebook.

    The page has the viewer from the installed package, about 23 MB, unless `RERUN_NOTEBOOK_ASSET` says otherwise:
    Rerun's own choice fetches it from the internet. None without Rerun's notebook support. ValueError for more flights
    than `styled.MOST`.
    """
    os.environ.setdefault("RERUN_NOTEBOOK_ASSET", "inline")  # read when the support is imported
    from rerun import notebook

    if not notebook.HAS_NOTEBOOK:
        return None
    to = Recorder()
    shown = notebook.Viewer(width="auto", height=_HEIGHT, recording=to.stream, use_global_recording=False)
    log_flights(to, logs, title)
    return shown
