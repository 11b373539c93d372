"""Self-organising map, mixtures and quantisers against MiniSom and scikit-learn."""

import numpy as np
import pytest
from tests.support.grasp_tables import made_up_grasps

from intent_inference.quantisation.mixture import GaussianMixture, fit_mixture
from intent_inference.quantisation.quantiser import QuantisationConfig, quantise
from intent_inference.quantisation.som import cluster_prototypes, davies_bouldin, fit_map
from intent_inference.quantisation.variables import coordinates_of


@pytest.mark.slow
def test_map_fits_as_well_as_minisom() -> None:
    minisom = pytest.importorskip("minisom")
    rng = np.random.default_rng(0)
    samples = rng.normal(size=(600, 2)) @ rng.normal(size=(2, 6)) + rng.normal(0, 0.2, (600, 6))
    ours = fit_map(samples, units=120)
    other = minisom.MiniSom(*ours.shape, 6, sigma=2.0, learning_rate=0.5, random_seed=0)
    other.pca_weights_init(samples)
    other.train(samples, 12000)
    assert ours.quantisation_error(samples) < 1.03 * other.quantization_error(samples)


def test_davies_bouldin_is_half_of_scikit_learns() -> None:
    from sklearn.metrics import davies_bouldin_score

    rng = np.random.default_rng(1)
    points = rng.normal(size=(200, 4))
    labels = cluster_prototypes(points, 5, rng)
    np.testing.assert_allclose(
        davies_bouldin(points, labels), 0.5 * davies_bouldin_score(points, labels), rtol=1e-12
    )


def test_u_matrix_is_brighter_between_clusters() -> None:
    rng = np.random.default_rng(2)
    samples = np.concatenate([rng.normal(-5, 0.5, (200, 3)), rng.normal(5, 0.5, (200, 3))])
    sheet = fit_map(samples, units=60)
    assert sheet.u_matrix().max() > 3.0 * np.median(sheet.u_matrix())
    assert sheet.hits(samples).sum() == 400


def test_mixture_densities_equal_scikit_learns() -> None:
    from sklearn.mixture import GaussianMixture as Reference

    rng = np.random.default_rng(3)
    samples = rng.normal(size=(300, 4)) + 3.0 * rng.integers(0, 2, (300, 1))
    first = np.eye(3)[rng.integers(0, 3, 300)]
    ours = fit_mixture(samples, first)
    other = Reference(3)
    other.weights_, other.means_, other.covariances_ = ours.weights, ours.means, ours.covariances
    inverse = np.linalg.inv(ours.covariances)
    other.precisions_cholesky_ = np.linalg.cholesky(inverse)
    np.testing.assert_allclose(ours.log_density(samples), other.score_samples(samples), atol=1e-9)
    np.testing.assert_allclose(
        ours.responsibilities(samples), other.predict_proba(samples), atol=1e-9
    )


def test_em_never_lowers_the_likelihood_of_its_start() -> None:
    rng = np.random.default_rng(4)
    samples = np.concatenate([rng.normal(-2, 1, (150, 2)), rng.normal(2, 0.5, (150, 2))])
    first = np.eye(2)[rng.integers(0, 2, 300)]
    start = fit_mixture(samples, first, iterations=1)
    assert (
        fit_mixture(samples, first).log_density(samples).mean() > start.log_density(samples).mean()
    )


def test_widening_equals_the_density_of_the_sum_of_two_gaussians() -> None:
    mixture = GaussianMixture(np.ones(1), np.zeros((1, 2)), np.eye(2)[None])
    wide = GaussianMixture(np.ones(1), np.zeros((1, 2)), np.diag([1.25, 1.0])[None])
    sample = np.array([[0.7, -0.4]])
    extra = np.diag([0.25, 0.0])[None]
    np.testing.assert_allclose(
        mixture.log_likelihoods(sample, extra), wide.log_likelihoods(sample), rtol=1e-12
    )


@pytest.mark.parametrize("variable", ["dir", "npos", "size"])
def test_coordinates_and_back_is_the_identity(variable: str) -> None:
    values = made_up_grasps(20).features[variable]
    coordinates = coordinates_of(variable)
    np.testing.assert_allclose(coordinates.project(coordinates.embed(values)), values, atol=1e-9)


@pytest.mark.parametrize("variable", ["dir", "npos", "size"])
def test_measurement_noise_is_carried_to_the_coordinates(variable: str) -> None:
    rng = np.random.default_rng(5)
    value = made_up_grasps(1).features[variable]
    step = 1e-3
    columns = value.shape[1]
    coordinates = coordinates_of(variable)
    noise = rng.normal(0.0, step, (40000, columns))
    if variable == "dir":  # noise stays on the unit sphere, as that of a rotation does
        noise -= (noise @ value[0])[:, None] * value
        deviation = np.full((1, columns), step * np.sqrt(3.0) / 2.0)
    else:
        deviation = np.full((1, columns), step)
    spread = np.cov(coordinates.embed(value + noise).T)
    jacobian = coordinates.jacobian(value, deviation)[0]
    np.testing.assert_allclose(jacobian @ jacobian.T, spread, atol=0.04 * spread.max())


def test_a_quaternion_and_its_negative_are_one_orientation() -> None:
    table = made_up_grasps(300)
    quantiser = quantise("dir", table.features["dir"], np.random.default_rng(0)).quantisers[8]
    np.testing.assert_allclose(
        quantiser.log_likelihoods(table.features["dir"]),
        quantiser.log_likelihoods(-table.features["dir"]),
        atol=1e-9,
    )


def test_likeliest_value_stays_on_the_manifold_and_the_expected_one_leaves_it() -> None:
    table = made_up_grasps(500)
    quantiser = quantise("npos", table.features["npos"], np.random.default_rng(0)).quantisers[12]
    states = np.full(quantiser.states, 1.0 / quantiser.states)
    likeliest = quantiser.values_of(quantiser.mixture.likeliest(states)[None])
    expected = quantiser.standardisation.invert(quantiser.mixture.expected(states)[None])
    np.testing.assert_allclose(np.linalg.norm(likeliest), 1.0, atol=1e-9)
    assert np.linalg.norm(expected) < 0.5


def test_draws_of_equation_two_follow_the_mixture() -> None:
    means = np.array([[0.0], [4.0]])
    mixture = GaussianMixture(np.array([0.5, 0.5]), means, np.full((2, 1, 1), 0.01))
    draws = mixture.sample(np.array([0.25, 0.75]), 4000, np.random.default_rng(0))
    assert abs((draws > 2.0).mean() - 0.75) < 0.03


def test_twenty_joint_angles_are_reduced_before_full_covariances() -> None:
    table = made_up_grasps(400)
    quantiser = quantise("fcon", table.features["fcon"], np.random.default_rng(0)).quantisers[6]
    assert quantiser.mixture.means.shape[1] <= 12


def test_likelihoods_of_far_values_give_no_nan() -> None:
    table = made_up_grasps(300)
    quantiser = quantise("size", table.features["size"], np.random.default_rng(0)).quantisers[4]
    far = quantiser.log_likelihoods(np.full((1, 3), 1e4))
    assert far.max() < -1e3
    assert np.isfinite(quantiser.mixture.responsibilities(np.full((1, 3), 1e4))).all()


def test_too_few_values_are_refused() -> None:
    with pytest.raises(ValueError, match="at least 10"):
        quantise("size", np.ones((5, 3)), np.random.default_rng(0), QuantisationConfig())
