"""The reason why a recorded flight does not answer a question."""


class CannotJudgeError(Exception):
    """A part cannot be judged; the message says why."""
