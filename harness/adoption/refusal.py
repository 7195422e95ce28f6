"""Why a model was not adopted: the stage, and what was found there."""


class RefusalError(ValueError):
    """A model cannot be adopted; the message says what was found, with its number, and a way out where there is one."""

    def __init__(self, stage: str, message: str) -> None:
        super().__init__(f"{stage}: {message}")
        self.stage = stage
        self.message = message

    def __reduce__(self) -> tuple[type["RefusalError"], tuple[str, str]]:  # a process may send it to another
        return RefusalError, (self.stage, self.message)


class NoSuchPropertyError(RefusalError):
    """The user names a control that the model does not have; `near` are names of its properties that are like it."""

    def __init__(self, name: str, near: tuple[str, ...]) -> None:
        like = f"; like it are {', '.join(near)}" if near else ""
        super().__init__("load", f"the model has no property {name}{like}")
        self.name, self.near = name, near

    def __reduce__(self) -> tuple[type["NoSuchPropertyError"], tuple[str, tuple[str, ...]]]:  # type: ignore[override]
        return NoSuchPropertyError, (self.name, self.near)
