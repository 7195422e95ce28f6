"""Why a model was not adopted: the stage, and what was found there."""


class RefusalError(ValueError):
    """A model cannot be adopted; the message says what was found, with its number, and a way out where there is one."""

    def __init__(self, stage: str, message: str) -> None:
        super().__init__(f"{stage}: {message}")
        self.stage = stage
        self.message = message

    def __reduce__(self) -> tuple[type["RefusalError"], tuple[str, str]]:  # a process may send it to another
        return RefusalError, (self.stage, self.message)
