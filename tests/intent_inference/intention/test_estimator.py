"""From grasps and reaches to task posteriors."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.support.grasp_tables import made_up_grasps

from intent_inference.intention.estimator import InferenceConfig, IntentionEstimator
from intent_inference.network.model_file import ModelFileError, save_model
from intent_inference.workshop.training.fitting import NetworkRecipe, TrainingConfig, train
from intent_perception.geometry.transforms import make_pose, rotation_from_vector, vector_from_pose
from intent_perception.objects.database import ObjectDatabase
from intent_tracking.grasp.grasp_detector import StableGrasp
from intent_tracking.grasp.grasp_features import GraspFeatures
from intent_tracking.scene.hand_model import HandModel
from intent_tracking.scene.scene_state import SceneState

OBJECT = "mug_0"
ON_TABLE = make_pose(np.eye(3), [0.0, 0.0, 0.05])
FORWARD = rotation_from_vector([0.0, np.pi / 2.0, 0.0])


@pytest.fixture(scope="module")
def model_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("model") / "model.npz"
    config = TrainingConfig(recipes=(NetworkRecipe("tan", "6"),))
    save_model(train(made_up_grasps(900), np.random.default_rng(0), config), path)
    return path


@pytest.fixture
def estimator(model_file: Path) -> IntentionEstimator:
    return IntentionEstimator(InferenceConfig(model=str(model_file)))


def grasp_of(row: int, seed: int = 1, **hidden: None) -> StableGrasp:
    table = made_up_grasps(60, seed=seed)
    values = {name: table.features[name][row] for name in table.features if name != "obcl"}
    features = GraspFeatures(
        object_class=str(table.features["obcl"][row]), coc=None, gbvl=None, **values
    )
    return StableGrasp(
        stamp=7,
        object_id="mug_0",
        object_model="mug_0",
        object_class=str(table.features["obcl"][row]),
        hand_side="right",
        features=replace(features, **hidden),
        std=GraspFeatures(None, None, None, None, None, None, None, None, None),
        T_object_hand=np.eye(4),
    )


def state_at(distance: float, stamp: int, side: str = "right", visible: bool = True) -> SceneState:
    """A hand pointing at the mug's side from -x, its palm's frame this far from the axis."""
    hand = np.concatenate(
        [vector_from_pose(make_pose(np.eye(3), [-distance, 0.0, 0.06])), np.full(20, 0.2)]
    )
    if not visible:
        hand = np.full(26, np.nan)
    state = np.concatenate([hand, vector_from_pose(ON_TABLE)])
    return SceneState(
        stamp=stamp,
        hand_side=side,  # type: ignore[arg-type]
        state=state,
        state_std=np.where(np.isfinite(state), 0.005, np.nan),
        hand_shape=HandModel("right").shape,
        object_ids=(OBJECT,),
        object_models=(OBJECT,),
        object_classes=("mug",),
        T_table_camera=np.eye(4),
        cost=0.0,
        hand_visible=visible,
        hand_lost=False,
        objects_lost=(False,),
    )


def test_a_stable_grasp_gives_a_final_posterior_of_every_task(
    estimator: IntentionEstimator,
) -> None:
    posterior = estimator.step(grasp_of(0))
    assert posterior is not None
    assert posterior.tasks == ("pouring", "hand-over")
    assert not posterior.preliminary
    assert np.all((posterior.probability > 0.0) & (posterior.probability < 1.0))
    assert posterior.stamp == 7
    above = {t for t, p in zip(posterior.tasks, posterior.probability, strict=True) if p > 0.5}
    assert set(posterior.above_threshold) == above
    meant = dict(zip(posterior.meanings, posterior.intends, strict=True))
    assert posterior.best == max(above, key=lambda task: meant[task], default=None)
    assert posterior.stage == "GRASP"


def test_unobserved_variables_are_named_and_change_the_answer(
    estimator: IntentionEstimator,
) -> None:
    whole = estimator.step(grasp_of(0))
    without = estimator.step(grasp_of(0, npos=None, fvol=None))
    assert whole is not None
    assert without is not None
    assert without.missing == ("npos", "fvol")
    assert not np.allclose(whole.probability, without.probability)


def test_explanation_is_the_fall_of_the_log_odds_without_each_variable(
    estimator: IntentionEstimator,
) -> None:
    whole = estimator.step(grasp_of(3))
    without = estimator.step(grasp_of(3, fvol=None))
    assert whole is not None
    assert without is not None
    log_odds = [np.log(p.probability / (1.0 - p.probability)) for p in (whole, without)]
    fall = {c.task: c.log_odds for c in whole.explanation if c.variable == "fvol"}
    for column, task in enumerate(whole.tasks):
        assert fall[task] == pytest.approx(log_odds[0][column] - log_odds[1][column], abs=1e-9)


def test_no_task_is_best_when_none_is_likely(model_file: Path) -> None:
    strict = IntentionEstimator(InferenceConfig(model=str(model_file), threshold=0.999))
    posterior = strict.step(grasp_of(0))
    assert posterior is not None
    assert posterior.best is None
    assert posterior.above_threshold == ()


def test_prior_shifts_the_log_odds(model_file: Path, estimator: IntentionEstimator) -> None:
    rare = IntentionEstimator(InferenceConfig(model=str(model_file), prior=0.2))
    plain, shifted = estimator.step(grasp_of(2)), rare.step(grasp_of(2))
    assert plain is not None
    assert shifted is not None
    odds = [p.probability / (1.0 - p.probability) for p in (plain, shifted)]
    np.testing.assert_allclose(odds[1], odds[0] * 0.25, rtol=1e-9)


def test_a_reach_gives_preliminary_posteriors_until_the_grasp(
    estimator: IntentionEstimator,
) -> None:
    for i, distance in enumerate((0.5, 0.45, 0.4, 0.35)):
        posterior = estimator.step(state_at(distance, stamp=i * 100_000_000))
        assert posterior is not None
        assert posterior.preliminary
        assert posterior.object_id == OBJECT
        assert {"coc", "gbvl", "fvol"} & set(posterior.missing) == {"fvol"}
    assert estimator.step(grasp_of(0)) is not None
    held = estimator.step(state_at(0.15, stamp=500_000_000))
    assert held is not None
    assert not held.preliminary
    left = estimator.step(state_at(0.45, stamp=700_000_000))
    assert left is not None
    assert left.stage == "PUT_BACK"
    reaching = estimator.step(state_at(0.42, stamp=733_000_000))
    assert reaching is not None
    assert (reaching.preliminary, reaching.stage) == (True, "REACH")


def test_word_of_the_same_reach_is_given_now_and_then(model_file: Path) -> None:
    states = [state_at(0.5 - 0.02 * i, stamp=i * 33_333_333) for i in range(7)]
    for period, spoken in ((0.1, [0, 3, 6]), (0.0, list(range(7)))):
        which = IntentionEstimator(InferenceConfig(model=str(model_file), period=period))
        said = [which.step(state) for state in states]
        assert [i for i, word in enumerate(said) if word is not None] == spoken


def test_nothing_is_said_without_a_hand_or_far_away(estimator: IntentionEstimator) -> None:
    assert estimator.step(state_at(0.4, stamp=0, visible=False)) is None
    assert estimator.step(state_at(1.5, stamp=1)) is None


def test_what_was_said_does_not_depend_on_later_frames(model_file: Path) -> None:
    distances = np.linspace(0.5, 0.2, 8)
    states = [state_at(d, stamp=i * 33_000_000) for i, d in enumerate(distances)]
    config = InferenceConfig(model=str(model_file), period=0.0)
    short, long = IntentionEstimator(config), IntentionEstimator(config)
    first = [short.step(s) for s in states[:4]]
    second = [long.step(s) for s in states]
    for a, b in zip(first, second, strict=False):
        assert a is not None
        assert b is not None
        np.testing.assert_array_equal(a.probability, b.probability)


def test_objects_of_the_reach_come_from_the_given_database(model_file: Path) -> None:
    assert OBJECT in ObjectDatabase.load(None)
    config = InferenceConfig(model=str(model_file), models="/nowhere")
    with pytest.raises(ValueError, match="nowhere"):
        IntentionEstimator(config).step(state_at(0.4, stamp=0))


def test_a_missing_model_is_named(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match="no model file"):
        IntentionEstimator(InferenceConfig(model=str(tmp_path / "none.npz")))


@pytest.mark.slow
def test_pgmpys_junction_tree_gives_the_same_posterior(
    model_file: Path, estimator: IntentionEstimator
) -> None:
    reference = IntentionEstimator(
        InferenceConfig(model=str(model_file), engine="junction-tree", explain=False)
    )
    for row in range(3):
        ours, theirs = estimator.step(grasp_of(row)), reference.step(grasp_of(row))
        assert ours is not None
        assert theirs is not None
        np.testing.assert_allclose(ours.probability, theirs.probability, atol=1e-9)


def test_bad_parameters_are_refused() -> None:
    with pytest.raises(ValueError, match="threshold"):
        InferenceConfig(threshold=1.5)
