"""GLB files in three.js, in a headless Chromium."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from a2g_jax.generation.delivery import Delivery
from a2g_jax.io.character import read_character
from a2g_jax.talker.recordings import talk
from a2g_jax.viz.mannequin_glb import write_mannequin_glb
from experiments.characters.skinned import vrm_1
from tests.browser_for_tests import chromium

pytestmark = pytest.mark.browser

PAGE = """<!doctype html>
<script type="importmap">{"imports": {"three": "/three/build/three.module.js", "three/addons/": "/three/examples/jsm/"}}</script>
<script type="module">
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

// Places of all nodes by name at some seconds of the first animation, and the share of pixels that the figure has.
window.played = async (times) => {
  const { scene, animations } = await new GLTFLoader().loadAsync("/file.glb");
  const mixer = new THREE.AnimationMixer(scene), action = mixer.clipAction(animations[0]);
  action.setLoop(THREE.LoopOnce); action.clampWhenFinished = true; action.play();
  const rows = times.map((time) => {
    mixer.setTime(time);
    scene.updateMatrixWorld(true);
    const row = {};
    scene.traverse((node) => { row[node.name] = new THREE.Vector3().setFromMatrixPosition(node.matrixWorld).toArray(); });
    return row;
  });
  const renderer = new THREE.WebGLRenderer({ preserveDrawingBuffer: true }), camera = new THREE.PerspectiveCamera(40, 1, 0.1, 20);
  renderer.setSize(128, 128);
  camera.position.set(0, 1, 3.2); camera.lookAt(0, 0.9, 0);
  scene.traverse((node) => { node.frustumCulled = false; });
  const stage = new THREE.Scene();
  stage.add(scene, new THREE.AmbientLight(0xffffff, 3));
  renderer.render(stage, camera);
  const gl = renderer.getContext(), pixels = new Uint8Array(4 * 128 * 128);
  gl.readPixels(0, 0, 128, 128, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let painted = 0;
  for (let i = 0; i < pixels.length; i += 4) if (pixels[i] + pixels[i + 1] + pixels[i + 2] > 0) painted += 1;
  return { rows, share: painted / (128 * 128), tracks: animations[0].tracks.length };
};
</script>
"""  # noqa: E501


@pytest.fixture(scope="module")
def three():
    """The folder of three.js."""
    node = shutil.which("node") or "false"
    probe = subprocess.run(
        [node, "-p", 'require.resolve("three")'],
        cwd=Path(__file__).parents[3],
        capture_output=True,
        text=True,
        check=False,
    )
    if probe.returncode:
        pytest.skip("no three here; install it with: npm install three (in the repository, or anywhere with NODE_PATH)")
    return Path(probe.stdout.strip()).parents[1]


@pytest.fixture(scope="module")
def motion():
    return talk(2.0, 1).motion.clip(5, 45)


def played(three, file, times):
    """What the page finds in a file."""

    def answer(route):
        path = route.request.url.partition("://three.test")[2]
        if path == "/":
            route.fulfill(body=PAGE, content_type="text/html")
        elif path == "/file.glb":
            route.fulfill(body=file.read_bytes(), content_type="model/gltf-binary")
        else:
            source = three / path.removeprefix("/three/")
            route.fulfill(body=source.read_bytes(), content_type="text/javascript")

    troubles = []
    with chromium() as browser:
        page = browser.new_page()
        page.on("pageerror", lambda error: troubles.append(str(error)))
        page.on("console", lambda message: troubles.append(message.text) if message.type == "error" else None)
        page.route("http://three.test/**", answer)
        page.goto("http://three.test/")
        page.wait_for_function("() => Boolean(window.played)")
        found = page.evaluate("times => window.played(times)", times)
        page.close()
    assert troubles == []
    return found


@pytest.mark.parametrize("character", [False, True])
def test_three_shows_the_file_and_moves_its_joints(three, motion, character, tmp_path):
    file = tmp_path / "motion.glb"
    if character:
        delivery = Delivery(character=read_character(vrm_1(tmp_path / "character.vrm")))
        own = delivery.make(motion).own
        delivery.written(file, own)
    else:
        own = motion
        write_mannequin_glb(file, motion)
    frames = [0, 13, 39]
    found = played(three, file, [frame / motion.fps for frame in frames])
    places = np.array([[row[name] for name in own.skeleton.names] for row in found["rows"]])
    np.testing.assert_allclose(places, own.positions()[frames], atol=1e-4)
    assert 0.03 < found["share"] < 0.5
    assert found["tracks"] == own.skeleton.joints + 1
