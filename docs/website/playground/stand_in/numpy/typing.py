"""Types of arrays: nothing looks at them."""


class NDArray:
    """numpy.typing.NDArray"""

    def __class_getitem__(cls, kind: object) -> object:
        return cls
