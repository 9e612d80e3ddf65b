"""glTF binary files (GLB): skinned characters in, animations out.

A bounded reader of the parts that an animation needs: nodes, skins and the humanoid bones of VRM. Everything else in a
file, such as meshes, materials, morph targets, textures and extensions, is neither looked at nor changed.
"""

from a2g_jax.io.gltf.container import Glb as Glb
from a2g_jax.io.gltf.container import read_glb as read_glb
from a2g_jax.io.gltf.container import write_glb as write_glb
