"""Every closed-form case of `runs.exact` for particles and bodies, and what its checks can tell."""

import pytest

from runs.exact import bodies, particles

pytestmark = pytest.mark.serial


@pytest.mark.parametrize("module", [particles, bodies])
def test_cases_agree_with_their_closed_forms(module):
    found = module.checks()
    assert [check.name for check in found if not check.error <= check.tolerance] == []
    assert len({check.name for check in found}) == len(found) >= 7


def test_stirred_block_tells_the_two_drag_laws_apart(monkeypatch):
    """The absolute law's orbit measured against the relative law's exponent is far off."""
    assert bodies.stirred_error("relative", 500) < 1e-3
    build = bodies.block
    monkeypatch.setattr(bodies, "block", lambda **changes: build(
        **changes | {"laws": {"drag": "absolute"}}))
    assert bodies.stirred_error("relative", 500) > 0.5
