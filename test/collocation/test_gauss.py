"""Gauss rules: their order, polynomials and spectrum."""

from __future__ import annotations

from math import factorial

from flex_planner.collocation import GaussRule
import numpy as np
import pytest

rules = pytest.mark.parametrize('stages', range(2, 13))


@rules
def test_gauss_rule_meets_its_order_conditions(stages: int) -> None:
    rule, powers = GaussRule.of(stages), np.arange(1, 2 * stages + 1)
    # rounding: the nodes come to a few units in the last place
    np.testing.assert_allclose(rule.weights @ np.power.outer(rule.nodes, powers - 1), 1 / powers,
                               rtol=1e-14)
    stage = powers[:stages]
    np.testing.assert_allclose(rule.matrix @ np.power.outer(rule.nodes, stage - 1),
                               np.power.outer(rule.nodes, stage) / stage, atol=1e-15)
    # and misses the next power by what the theory says
    missed = factorial(stages)**4 / factorial(2 * stages)**2 / (2 * stages + 1)
    assert 1 / (2 * stages + 1) - rule.weights @ rule.nodes ** (2 * stages) == pytest.approx(
        missed, rel=1e-9, abs=1e-15)


@rules
def test_basis_integrates_and_interpolates_polynomials(stages: int) -> None:
    rule, theta = GaussRule.of(stages), np.linspace(0, 1, 17)
    powers = np.arange(stages)
    rates = np.power.outer(rule.nodes, powers)
    np.testing.assert_allclose(rule.basis_rate(theta) @ rates, np.power.outer(theta, powers),
                               atol=2e-14)
    np.testing.assert_allclose(rule.basis(theta) @ rates,
                               np.power.outer(theta, powers + 1) / (powers + 1), atol=1e-15)
    np.testing.assert_allclose(rule.basis(np.ones(1))[0], rule.weights, atol=1e-15)
    np.testing.assert_allclose(rule.basis(rule.nodes), rule.matrix, atol=1e-15)


@rules
def test_spectrum_stands_for_the_matrix_and_its_inverse(stages: int) -> None:
    rule = GaussRule.of(stages)
    values, vectors, inverse = (rule.spectrum.eigenvalues, rule.spectrum.vectors,
                                rule.spectrum.inverse)
    assert values.size == (stages + 1) // 2
    assert (values.imag >= 0).all()
    assert (values.real > 0).all()  # the equations of a decaying unknown are never singular
    # the eigenvectors of many stages are nearly dependent: rounding them to double costs so much
    atol = max(1e-15, np.finfo(float).eps * (np.abs(vectors) @ np.abs(inverse)).max())
    np.testing.assert_allclose((vectors * values @ inverse).real, rule.matrix, atol=atol)
    np.testing.assert_allclose((vectors @ inverse).real, np.eye(stages), atol=atol)
    np.testing.assert_allclose((vectors / (1 - 0.7 * values) @ inverse).real,
                               np.linalg.inv(np.eye(stages) - 0.7 * rule.matrix), atol=atol)


@pytest.mark.parametrize('stages', [1, 13])
def test_gauss_rule_has_2_to_12_stages(stages: int) -> None:
    with pytest.raises(ValueError, match=f'stages is {stages}, but must be from 2 to 12'):
        GaussRule.of(stages)
