"""What the service refuses, by code and field."""

import limber
import pytest


def refusal(call):
    with pytest.raises(limber.LimberError) as caught:
        call()
    return caught.value.code, caught.value.field
