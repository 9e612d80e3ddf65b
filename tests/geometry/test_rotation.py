"""Rotation forms against SciPy, and the laws they obey."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from a2g_jax.geometry import rotation as rot

COUNT = 64

from_6d = jax.jit(rot.matrix_from_6d)
to_6d = jax.jit(rot.matrix_to_6d)
from_quaternion = jax.jit(rot.matrix_from_quaternion)
to_quaternion = jax.jit(rot.quaternion_from_matrix)
exp = jax.jit(rot.quaternion_from_axis_angle)
log = jax.jit(rot.axis_angle_from_quaternion)
matrix_exp = jax.jit(rot.matrix_from_axis_angle)
matrix_log = jax.jit(rot.axis_angle_from_matrix)
geodesic = jax.jit(rot.geodesic_distance)
slerp = jax.jit(rot.slerp)
various = jax.jit(
    lambda matrix: (
        rot.quaternion_from_matrix(matrix),
        rot.matrix_to_6d(matrix),
        rot.axis_angle_from_matrix(matrix),
        rot.geodesic_distance(matrix, matrix),
    )
)


def random_rotations(count=COUNT, seed=0):
    return Rotation.random(count, rng=np.random.default_rng(seed))


def wxyz(rotation):
    """SciPy's quaternion with w first and positive."""
    return rotation.as_quat(canonical=True, scalar_first=True)


def random_axes(count=COUNT, seed=1):
    axes = np.random.default_rng(seed).normal(size=(count, 3))
    return axes / np.linalg.norm(axes, axis=1, keepdims=True)


def spun(angles, seed=1):
    """Rotations by given angles (radians) about random axes."""
    angles = np.asarray(angles, np.float64)
    return Rotation.from_rotvec(random_axes(len(angles), seed) * angles[:, None])


@pytest.fixture(params=["float32", "float64"])
def precision(request):
    """(dtype, tolerance): working precision, with JAX set to it."""
    if request.param == "float32":
        yield np.float32, 2e-6
    else:
        with jax.enable_x64(True):
            yield np.float64, 2e-14


class TestAgainstScipy:
    def test_matrix_from_quaternion(self, precision):
        dtype, tolerance = precision
        expected = random_rotations()
        result = from_quaternion(wxyz(expected).astype(dtype))
        assert result.dtype == dtype
        np.testing.assert_allclose(result, expected.as_matrix(), atol=tolerance)

    def test_quaternion_from_matrix(self, precision):
        dtype, tolerance = precision
        expected = random_rotations()
        np.testing.assert_allclose(to_quaternion(expected.as_matrix().astype(dtype)), wxyz(expected), atol=tolerance)

    def test_exponential_map(self, precision):
        dtype, tolerance = precision
        expected = random_rotations()
        vector = expected.as_rotvec().astype(dtype)
        np.testing.assert_allclose(exp(vector), wxyz(expected), atol=tolerance)
        np.testing.assert_allclose(matrix_exp(vector), expected.as_matrix(), atol=tolerance)

    def test_logarithm(self, precision):
        dtype, tolerance = precision
        expected = random_rotations()
        np.testing.assert_allclose(log(wxyz(expected).astype(dtype)), expected.as_rotvec(), atol=4 * tolerance)
        np.testing.assert_allclose(
            matrix_log(expected.as_matrix().astype(dtype)), expected.as_rotvec(), atol=4 * tolerance
        )

    def test_6d_is_the_first_two_columns(self, precision):
        dtype, tolerance = precision
        matrix = random_rotations().as_matrix()
        six = np.concatenate([matrix[:, :, 0], matrix[:, :, 1]], axis=1)
        np.testing.assert_array_equal(to_6d(matrix.astype(dtype)), six.astype(dtype))
        np.testing.assert_allclose(from_6d(six.astype(dtype)), matrix, atol=tolerance)

    def test_gram_schmidt_of_arbitrary_vectors(self, precision):
        dtype, tolerance = precision
        six = np.random.default_rng(3).normal(size=(COUNT, 6))
        first = six[:, :3] / np.linalg.norm(six[:, :3], axis=1, keepdims=True)
        second = six[:, 3:] - np.sum(first * six[:, 3:], axis=1, keepdims=True) * first
        second /= np.linalg.norm(second, axis=1, keepdims=True)
        expected = np.stack([first, second, np.cross(first, second)], axis=-1)
        np.testing.assert_allclose(from_6d(six.astype(dtype)), expected, atol=10 * tolerance)

    def test_geodesic_distance(self, precision):
        dtype, tolerance = precision
        first, second = random_rotations(seed=0), random_rotations(seed=1)
        result = geodesic(first.as_matrix().astype(dtype), second.as_matrix().astype(dtype))
        np.testing.assert_allclose(result, (first.inv() * second).magnitude(), atol=4 * tolerance)

    def test_slerp(self, precision):
        dtype, tolerance = precision
        first, second = random_rotations(seed=0), random_rotations(seed=1)
        weights = np.random.default_rng(2).uniform(size=COUNT).astype(dtype)
        expected = np.stack(
            [
                Slerp([0, 1], Rotation.concatenate([first[n], second[n]]))(float(weights[n])).as_matrix()
                for n in range(COUNT)
            ]
        )
        result = from_quaternion(slerp(wxyz(first).astype(dtype), wxyz(second).astype(dtype), weights))
        np.testing.assert_allclose(result, expected, atol=10 * tolerance)


class TestLaws:
    @pytest.mark.parametrize("shape", [(), (2, 3, 4)])
    def test_leading_axes(self, shape):
        matrix = random_rotations(24).as_matrix().astype(np.float32)
        count = int(np.prod(shape))
        result = various(matrix[:count].reshape((*shape, 3, 3)))
        flat = various(matrix)
        for part, whole in zip(result, flat, strict=True):
            expected = np.asarray(whole)[:count].reshape((*shape, *whole.shape[1:]))
            assert part.shape == expected.shape
            np.testing.assert_allclose(part, expected, atol=1e-6)

    def test_round_trips(self, precision):
        dtype, tolerance = precision
        matrix = random_rotations(seed=6).as_matrix().astype(dtype)
        for name, back in {
            "6d": from_6d(to_6d(matrix)),
            "quaternion": from_quaternion(to_quaternion(matrix)),
            "axis-angle": matrix_exp(matrix_log(matrix)),
        }.items():
            np.testing.assert_allclose(back, matrix, atol=20 * tolerance, err_msg=name)

    def test_quaternions_have_positive_real_part(self):
        # Rotations by just under, exactly and just over half a turn, about axes of every sign.
        angles = np.concatenate([np.linspace(np.pi - 1e-3, np.pi + 1e-3, COUNT - 8), np.full(8, np.pi)])
        matrix = spun(angles).as_matrix().astype(np.float32)
        result = np.asarray(to_quaternion(matrix))
        assert (result[:, 0] >= 0).all()
        np.testing.assert_allclose(np.linalg.norm(result, axis=1), 1, atol=1e-6)
        np.testing.assert_allclose(from_quaternion(result), matrix, atol=2e-6)

    @settings(max_examples=60, deadline=None)
    @given(
        st.sampled_from([0.0, np.pi]),
        st.floats(-18, 0),
        st.integers(0, 10**6),
    )
    def test_log_inverts_exp_near_the_identity_and_half_turns(self, centre, exponent, seed):
        with jax.enable_x64(True):
            angle = abs(centre - 10.0**exponent)
            axis = random_axes(1, seed)[0]
            vector = np.broadcast_to(angle * axis, (COUNT, 3))
            result = log(exp(vector))[0]
            if angle == np.pi and np.dot(result, vector[0]) < 0:
                result = -result  # both axes mean the same half turn
            np.testing.assert_allclose(result, vector[0], atol=1e-14, rtol=1e-14)
            through_matrix = np.asarray(matrix_log(matrix_exp(vector))[0])
            if np.pi - angle < 1e-12 and np.dot(through_matrix, vector[0]) < 0:
                through_matrix = -through_matrix
            np.testing.assert_allclose(through_matrix, vector[0], atol=1e-14)

    @settings(max_examples=30, deadline=None)
    @given(st.lists(st.floats(-50, 50, width=32), min_size=3, max_size=3))
    def test_exp_of_any_vector_is_a_unit_quaternion(self, vector):
        vector = np.array([vector] * COUNT, np.float32)
        np.testing.assert_allclose(np.linalg.norm(exp(vector)[0]), 1, atol=1e-6)
        np.testing.assert_allclose(matrix_exp(vector)[0], Rotation.from_rotvec(vector[0]).as_matrix(), atol=2e-5)

    def test_exp_and_log_have_the_right_gradient(self, x64):
        lengths = np.array([0.0, 1e-30, 1e-10, 1e-8, 1.4e-8, 1.6e-8, 1e-4, 1.0, np.pi - 1e-3])
        vectors = lengths[:, None] * random_axes(len(lengths), 8)
        jacobians = jax.jit(
            jax.vmap(jax.jacobian(lambda v: rot.axis_angle_from_quaternion(rot.quaternion_from_axis_angle(v))))
        )(vectors)
        np.testing.assert_allclose(jacobians, np.broadcast_to(np.eye(3), jacobians.shape), atol=1e-10)


HARD_6D = {
    "zero": [0, 0, 0, 0, 0, 0],
    "first zero": [0, 0, 0, 0, 1, 0],
    "second zero": [0, 1, 0, 0, 0, 0],
    "equal": [1, 2, 3, 1, 2, 3],
    "opposite": [1, 2, 3, -1, -2, -3],
    "parallel along x": [2, 0, 0, -5, 0, 0],
    "parallel along y": [0, 2, 0, 0, 3, 0],
    "parallel along z": [0, 0, -2, 0, 0, 3],
    "nearly parallel": [1, 0, 0, 1, 1e-5, 0],
    "just not parallel": [1, 2, 3, 1, 2, 3.01],
    "second parallel to the fallback": [0, 0, 0, 1, 0, 0],
    "tiny": [1e-6, 2e-6, 0, 0, 1e-6, 1e-6],
    "tiny first": [1e-12, 0, 0, 0, 1, 0],
    "tiny second": [1, 0, 0, 1e-12, 1e-12, 0],
    "vanishing second": [1, 0, 0, 0, 1e-17, 0],
    "denormal second": [1, 0, 0, 0, 1e-21, 0],
    "tiny and parallel": [1e-20, 0, 0, 1e-20, 0, 0],
    "large": [1e6, 2e6, 0, -1e6, 1e6, 5e6],
    "huge": [1e15, 0, 1e15, 0, 1e15, 3e15],
    "huge first": [1e15, 2e15, 0, 0, 0, 1],
    "squares overflow": [1e25, 2e25, 0, 0, 0, 1e25],
    "second's square overflows": [1, 0, 0, 0, 1e25, 0],
}


class TestGramSchmidt:
    @pytest.mark.parametrize("name", HARD_6D)
    def test_is_always_a_rotation_with_a_finite_gradient(self, name):
        six = jnp.array(HARD_6D[name], jnp.float32)
        matrix = np.asarray(from_6d(six), np.float64)
        tolerance = 1e-3 if "just not" in name else 2e-6  # the difference of near equals keeps few digits
        np.testing.assert_allclose(matrix.T @ matrix, np.eye(3), atol=tolerance)
        np.testing.assert_allclose(np.linalg.det(matrix), 1, atol=tolerance)
        jacobian = jac_6d(six)
        assert np.isfinite(jacobian).all(), jacobian

    @settings(max_examples=100, deadline=None)
    @given(st.lists(st.floats(-100, 100, width=32), min_size=6, max_size=6))
    def test_any_six_numbers_make_a_rotation(self, numbers):
        matrix = np.asarray(from_6d(np.array(numbers, np.float32)), np.float64)
        np.testing.assert_allclose(matrix.T @ matrix, np.eye(3), atol=1e-3)
        np.testing.assert_allclose(np.linalg.det(matrix), 1, atol=1e-3)

    def test_a_small_clean_pair_is_not_taken_for_degenerate(self):
        matrix = from_6d(np.array([0, 1e-3, 0, 0, 0, 1e-6], np.float32))
        np.testing.assert_allclose(matrix, [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-6)

    def test_gradient_is_that_of_the_formula(self, x64):
        six = np.random.default_rng(9).normal(size=6)
        jacobian = jac_6d(jnp.asarray(six))
        step = 1e-6
        expected = np.stack(
            [(from_6d(six + step * unit) - from_6d(six - step * unit)) / (2 * step) for unit in np.eye(6)], axis=-1
        )
        np.testing.assert_allclose(jacobian, expected, atol=1e-8)


jac_6d = jax.jit(jax.jacrev(rot.matrix_from_6d))
distance_gradient = jax.jit(jax.vmap(jax.grad(rot.geodesic_distance, (0, 1))))


class TestGeodesic:
    #: The identity, half turns, and everything down to angles that float32 cannot tell from them.
    angles = np.concatenate(
        [[0.0, np.pi], 10.0 ** np.arange(-15, 0.5, 0.5), np.pi - 10.0 ** np.arange(-15, 0, 0.5), [1.0]]
    )

    def test_gradient_is_bounded_everywhere(self, precision):
        dtype, _ = precision
        base = random_rotations(len(self.angles), 10)
        other = base * spun(self.angles)
        for gradient in distance_gradient(base.as_matrix().astype(dtype), other.as_matrix().astype(dtype)):
            assert np.isfinite(gradient).all()
            assert np.linalg.norm(np.asarray(gradient).reshape(-1, 9), axis=1).max() <= 1.5

    def test_gradient_at_exactly_equal_rotations_is_zero(self):
        eye = np.eye(3, dtype=np.float32)[None]
        half = np.diag([1.0, -1.0, -1.0]).astype(np.float32)[None]
        for first, second, distance in ((eye, eye, 0.0), (eye, half, np.pi), (half, half, 0.0)):
            assert geodesic(first, second)[0] == pytest.approx(distance, abs=1e-6)
            for gradient in distance_gradient(first, second):
                np.testing.assert_allclose(gradient, 0, atol=1e-6)

    def test_small_and_near_half_turn_angles_keep_their_digits(self, x64):
        base = random_rotations(len(self.angles), 11)
        result = geodesic(base.as_matrix(), (base * spun(self.angles)).as_matrix())
        np.testing.assert_allclose(result, self.angles, atol=1e-15 * 10)

    def test_float32_sees_angles_of_a_millidegree(self):
        tiny = Rotation.from_rotvec([[0, np.radians(0.001), 0]]).as_matrix().astype(np.float32)
        assert geodesic(np.eye(3, dtype=np.float32)[None], tiny)[0] == pytest.approx(np.radians(0.001), rel=1e-3)

    def test_gradient_along_the_rotations(self, x64):
        """Turning the second rotation further about the same axis adds the angle: slope 1, on both sides."""
        angles = self.angles[(self.angles > 1e-6) & (self.angles < np.pi - 1e-6)]
        axes = random_axes(len(angles))
        base = random_rotations(len(angles), 12).as_matrix()

        @jax.jit
        @jax.vmap
        def slope(matrix, axis, angle):
            def turned(a):
                return rot.geodesic_distance(matrix, matrix @ rot.matrix_from_axis_angle(a * axis))

            return jax.grad(turned)(angle)

        np.testing.assert_allclose(slope(base, axes, angles), 1, atol=1e-8)

    def test_gradient_against_central_differences(self, x64):
        first, second = random_rotations(4, 13).as_matrix(), random_rotations(4, 14).as_matrix()
        gradient = distance_gradient(first, second)
        direction = np.random.default_rng(15).normal(size=(2, *first.shape))
        step = 1e-6
        ends = [geodesic(first + sign * step * direction[0], second + sign * step * direction[1]) for sign in (1, -1)]
        expected = (ends[0] - ends[1]) / (2 * step)
        inner = sum(np.sum(np.asarray(g) * d, axis=(1, 2)) for g, d in zip(gradient, direction, strict=True))
        np.testing.assert_allclose(inner, expected, atol=1e-8)

    def test_is_a_symmetric_distance(self):
        first, second, third = (random_rotations(seed=n).as_matrix().astype(np.float32) for n in (1, 2, 3))
        np.testing.assert_allclose(geodesic(first, second), geodesic(second, first), atol=1e-6)
        assert (geodesic(first, third) <= geodesic(first, second) + geodesic(second, third) + 1e-5).all()


class TestSlerp:
    @pytest.mark.parametrize("weight", [0.0, 0.25, 1.0])
    def test_equal_and_antipodal_quaternions_stay(self, weight):
        quaternion = wxyz(random_rotations()).astype(np.float32)
        weights = np.full(COUNT, weight, np.float32)
        for end in (quaternion, -quaternion):
            np.testing.assert_allclose(slerp(quaternion, end, weights), quaternion, atol=1e-6)

    def test_ends(self):
        first, second = (wxyz(random_rotations(seed=n)).astype(np.float32) for n in (1, 2))
        np.testing.assert_allclose(slerp(first, second, np.zeros(COUNT, np.float32)), first, atol=1e-6)
        end = from_quaternion(slerp(first, second, np.ones(COUNT, np.float32)))
        np.testing.assert_allclose(end, from_quaternion(second), atol=1e-6)

    def test_shorter_arc_whatever_the_sign(self):
        first, second = (wxyz(random_rotations(seed=n)).astype(np.float32) for n in (1, 2))
        weights = np.full(COUNT, 0.3, np.float32)
        np.testing.assert_allclose(slerp(first, second, weights), slerp(first, -second, weights), atol=1e-6)

    def test_constant_speed_over_tiny_and_wide_angles(self, x64):
        angles = np.concatenate([10.0 ** np.linspace(-12, 0, COUNT - 2), [3.0, np.pi - 1e-9]])
        start = random_rotations(seed=3)
        end = start * spun(angles)
        for weight in (0.2, 0.7):
            middle = from_quaternion(slerp(wxyz(start), wxyz(end), np.full(COUNT, weight)))
            np.testing.assert_allclose(
                geodesic(start.as_matrix(), middle), weight * angles, atol=1e-14, rtol=1e-9, err_msg=str(weight)
            )

    def test_gradients_are_finite_for_equal_quaternions(self):
        quaternion = wxyz(random_rotations()).astype(np.float32)
        gradients = jax.jit(jax.grad(lambda a, b, w: rot.slerp(a, b, w).sum(), (0, 1, 2)))
        for end in (quaternion, -quaternion):
            for gradient in gradients(quaternion, end, np.full(COUNT, 0.3, np.float32)):
                assert np.isfinite(gradient).all()


def test_safe_norm():
    norm = jax.value_and_grad(rot.safe_norm)
    value, gradient = norm(jnp.zeros(3))
    assert value == 0
    np.testing.assert_array_equal(gradient, np.zeros(3))
    value, gradient = norm(jnp.array([3.0, 0.0, 4.0]))
    assert value == 5
    np.testing.assert_allclose(gradient, [0.6, 0, 0.8], atol=1e-6)
