// GLSL. Every body part is one instance of a round cone, a tube between two spheres that touches both smoothly; or places
// and normals are given (`soup.js`). Each shader exists in both kinds.

const CAPSULE = `#version 300 es
precision highp float;
layout(location = 0) in vec4 mesh;   // which end, latitude 0..1 within its cap, cos and sin of longitude
layout(location = 1) in vec4 start;  // centre, radius
layout(location = 2) in vec4 end;
layout(location = 3) in vec4 axis;   // direction of flattening, thickness
layout(location = 4) in vec4 colour; // linear light, gloss (below 0: not lit)
void surface(out vec3 place, out vec3 normal) {
  vec3 along = end.xyz - start.xyz;
  float size = length(along);
  vec3 z = size > 1e-5 ? along / size : vec3(0.0, 1.0, 0.0);
  vec3 y = axis.xyz - z * dot(axis.xyz, z);
  if (dot(y, y) < 1e-6) { y = abs(z.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0); y -= z * dot(y, z); }
  y = normalize(y);
  vec3 x = cross(y, z);
  // The tube touches both spheres at this latitude.
  float contact = asin(clamp((start.w - end.w) / max(size, 1e-5), -0.98, 0.98));
  float latitude = mesh.x < 0.5 ? mix(-1.5707963, contact, mesh.y) : mix(contact, 1.5707963, mesh.y);
  vec3 n = vec3(cos(latitude) * mesh.zw, sin(latitude));
  float radius = mesh.x < 0.5 ? start.w : end.w;
  place = mix(start.xyz, end.xyz, mesh.x) + radius * (x * n.x + y * (n.y * axis.w) + z * n.z);
  normal = normalize(x * n.x + y * (n.y / axis.w) + z * n.z);
}
`;

const GIVEN = `#version 300 es
precision highp float;
layout(location = 0) in vec3 given;
layout(location = 1) in vec3 facing;
layout(location = 2) in float open;  // share of the sky's light
layout(location = 4) in vec4 colour;
void surface(out vec3 place, out vec3 normal) { place = given; normal = facing; }
`;

// Light of the sky that reaches a place, with capsules of the body in the way.
const OCCLUSION = `
uniform vec4 shadeStart[14], shadeEnd[14];  // centre, radius; centre, part
uniform int shades;
float occlusion(vec3 place, vec3 n, int part) {
  float open = 1.0;
  for (int i = 0; i < shades; i++) {
    if (int(shadeEnd[i].w) == part) continue;
    vec3 a = shadeStart[i].xyz, along = shadeEnd[i].xyz - a, from = place - a;
    float h = clamp(dot(from, along) / max(dot(along, along), 1e-8), 0.0, 1.0);
    vec3 d = h * along - from;
    float r = shadeStart[i].w, far = max(length(d), 0.8 * r);
    if (far > 5.0 * r) continue;
    float covered = max(dot(d / far, n), 0.0) * (r * r) / (far * far);
    open *= 1.0 - 0.85 * clamp(covered, 0.0, 1.0);
  }
  return open;
}
`;

const bodyVertex = (given) => (given ? GIVEN : CAPSULE) + `
uniform mat4 camera, light;
uniform int first;
out vec3 place, normal, lit;
flat out vec4 paint;
flat out int part;
out float sky;
void main() {
  surface(place, normal);
  paint = colour;
  part = first + gl_InstanceID;
  sky = ${given ? "open" : "1.0"};
  vec4 seen = light * vec4(place + normal * 0.008, 1.0);
  lit = seen.xyz * 0.5 + 0.5;
  gl_Position = camera * vec4(place, 1.0);
}`;

// Of cones, the occlusion is found at every pixel. With one tap the shadow has no soft edge.
const bodyFragment = (given, taps) => `#version 300 es
precision highp float;
precision highp sampler2DShadow;
uniform sampler2DShadow depths;
uniform vec3 eye, sun, sunColour, skyColour, bounce;
uniform float alpha, texel, floorHeight;
in vec3 place, normal, lit;
flat in vec4 paint;
flat in int part;
in float sky;
out vec4 result;
${given ? "" : OCCLUSION}void main() {
  vec3 n = normalize(normal), v = normalize(eye - place);
  if (paint.a < 0.0) { result = vec4(pow(paint.rgb, vec3(1.0 / 2.2)), alpha); return; }
  float open = ${given ? "sky" : "occlusion(place, n, part)"};
  // The ground hides the lower half of the sky from what is close to it.
  float low = clamp((place.y - floorHeight) / 0.35, 0.0, 1.0);
  open *= mix(mix(0.45, 1.0, low), 1.0, clamp(n.y * 0.5 + 0.5, 0.0, 1.0));
  float face = dot(n, sun);
  float sunlight = 0.0;
  if (face > 0.0) {
    float bias = -0.0012;
    for (int i = 0; i < ${taps}; i++) {
      vec2 o = ${taps === 1 ? "vec2(0.0)" : "vec2(i < 2 ? -0.9 : 0.9, (i & 1) == 0 ? -0.9 : 0.9)"};
      sunlight += ${(1 / taps).toFixed(2)} * texture(depths, vec3(lit.xy + o * texel, lit.z + bias));
    }
    sunlight *= face;
  }
  vec3 ambient = mix(bounce, skyColour, n.y * 0.5 + 0.5) * open;
  vec3 halfway = normalize(sun + v);
  float gloss = paint.a, shine = pow(max(dot(n, halfway), 0.0), mix(18.0, 90.0, gloss)) * mix(0.05, 0.5, gloss);
  float rim = pow(1.0 - max(dot(n, v), 0.0), 3.0);
  vec3 light = paint.rgb * (ambient + sunColour * 0.42 * sunlight) + shine * sunlight * sunColour * 0.5
    + rim * skyColour * 0.16 * open;
  result = vec4(pow(light, vec3(1.0 / 2.2)), alpha);
}`;

const depthVertex = (given) => (given ? GIVEN : CAPSULE) + `
uniform mat4 light;
void main() {
  vec3 place, normal;
  surface(place, normal);
  gl_Position = light * vec4(place, 1.0);
}`;

const EMPTY_FRAGMENT = `#version 300 es
precision highp float;
out vec4 result;
void main() { result = vec4(1.0); }`;

// Shadows on the ground, drawn flat into a map of it. Red: cast by what is low, sharp later; blue: by what is high,
// blurred more; green: closeness of bodies above, for the soft darkening at the feet.
const spotVertex = (given) => (given ? GIVEN : CAPSULE) + `
uniform vec4 area;  // centre x, z and half size
uniform vec3 sun;
uniform float above;
out float high;
void main() {
  vec3 place, normal;
  surface(place, normal);
  high = max(place.y, 0.0);
  vec2 spot = above > 0.5 ? place.xz : place.xz - sun.xz * (place.y / sun.y);
  gl_Position = vec4((spot - area.xy) / area.zw, 0.0, 1.0);
}`;

const SPOT_FRAGMENT = `#version 300 es
precision highp float;
uniform float above;
in float high;
out vec4 result;
void main() {
  float up = smoothstep(0.1, 1.3, high);
  result = above > 0.5 ? vec4(0.0, exp(-high * 4.0), 0.0, 1.0) : vec4(1.0 - up, 0.0, up, 1.0);
}`;

const BLUR_VERTEX = `#version 300 es
out vec2 uv;
void main() {
  uv = vec2(gl_VertexID == 1 ? 2.0 : 0.0, gl_VertexID == 2 ? 2.0 : 0.0);
  gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0);
}`;

const BLUR_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D source;
uniform vec2 stride;
in vec2 uv;
out vec4 result;
void main() {
  vec3 sum = vec3(0.0), weights = vec3(0.0);
  for (int i = -5; i <= 5; i++) {
    float x = float(i);
    vec3 w = exp(-x * x * vec3(0.9, 0.13, 0.075));
    sum += w * texture(source, uv + x * stride).rgb;
    weights += w;
  }
  result = vec4(sum / weights, 1.0);
}`;

const GROUND_VERTEX = `#version 300 es
precision highp float;
uniform mat4 back;  // from clip space to the stage
out vec3 far;
out vec2 screen;
void main() {
  vec2 p = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  vec4 q = back * vec4(p, 1.0, 1.0);
  far = q.xyz / q.w;
  screen = p;
  gl_Position = vec4(p, 1.0, 1.0);
}`;

const GROUND_FRAGMENT = `#version 300 es
precision highp float;
uniform sampler2D spots;
uniform vec3 eye, top, horizon, groundA, groundB, shadowTint;
uniform vec2 turn, strength;
uniform vec4 area;
uniform float fade;
in vec3 far;
in vec2 screen;
out vec4 result;
// Distance-filtered square wave: the mean of sign(sin) over a pixel is a difference of triangle waves.
vec2 squares(vec2 p, vec2 width) {
  vec2 a = fract(p - 0.5 * width), b = fract(p + 0.5 * width);
  return (abs(b - 0.5) - abs(a - 0.5)) / width;
}
void main() {
  vec3 ray = far - eye;
  float up = clamp(normalize(ray).y, 0.0, 1.0);
  vec3 colour = mix(horizon, top, smoothstep(0.0, 0.26, up));
  float t = -eye.y / ray.y;
  vec2 p = eye.xz + ray.xz * t;
  vec2 q = vec2(turn.x * p.x + turn.y * p.y, turn.x * p.y - turn.y * p.x);
  vec2 width = max(fwidth(q), vec2(1e-4));
  if (t > 0.0) {
    vec2 s = squares(q, width);
    vec3 ground = mix(groundA, groundB, 0.5 + 0.5 * s.x * s.y);
    vec2 uv = (p - area.xy) / area.zw * 0.5 + 0.5;
    vec3 spot = texture(spots, uv).rgb;
    float shade = strength.x * min(spot.r + spot.b, 1.0);
    shade = 1.0 - (1.0 - shade) * (1.0 - strength.y * spot.g);
    ground = mix(ground, shadowTint * ground * 1.2, shade);
    float away = length(p) / fade;
    colour = mix(colour, ground, exp(-away * away));
  }
  float grain = fract(sin(dot(gl_FragCoord.xy, vec2(12.9898, 78.233))) * 43758.5453) - 0.5;
  result = vec4(pow(colour, vec3(1.0 / 2.2)) + grain / 255.0, 1.0);
}`;
