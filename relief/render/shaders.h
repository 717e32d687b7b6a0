// The programs that run on the graphics driver, in GLSL 4.50; make_program() writes the line with the version.
#pragma once

#include <string_view>

namespace relief::detail {

/// Lights in one pass over the picture; the arrays below have this size.
inline constexpr int kBatch = 8;

/// Position on the fibre, from the lattice of the slab's root. A sample on a wall between roots has one weight of zero,
/// so its sum is the same bits in both slabs, whatever the order of their corners; `precise` keeps it so. Within a root
/// the weights are the same bits, as they differ by powers of two above and below.
inline constexpr std::string_view kPlace = R"(
layout(std430, binding = 1) readonly buffer Places { uint places[]; };
layout(location = 0) in vec3 inner[3];  // of the root
layout(location = 3) in vec3 outer[3];
layout(location = 6) in uvec4 data;     // first sample, n and first place, first colour, m
layout(location = 7) in uvec2 words;    // of the sample
layout(location = 8) in uvec3 part;     // where own weights begin in the root, corners 0 and 1, with the level and
                                        // whether it is turned round; number of the slab
layout(location = 0) uniform mat4 projection;
vec3 unpack_normal(uint code) {
  vec2 p = vec2(code & 4095u, (code >> 12) & 4095u) / 2047.5 - 1.0;
  vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
  return normalize(n);
}
struct Vertex {
  vec3 position, normal, weights;
  vec2 alpha_hollow;
  float mask, height, clay, slab;  // above the fibre's middle, to its nearer end: lengths; a number in 0..1 of its own
  vec4 root;                       // where own weights begin in the root, and 1 or -1: the way that they count there
};
Vertex place_vertex() {
  uint n = data.y & 255u, place = places[(data.y >> 8) + uint(gl_VertexID) - data.x];
  uint i = place & 255u, j = place >> 8;
  ivec3 own = ivec3(n - i - j, i, j);
  int steps = 1 << int(part.x >> 24), turn = (part.y >> 31) != 0u ? -1 : 1;
  ivec3 begin = ivec3(part.x & 0xffffffu, part.y & 0xffffffu, 0);
  begin.z = steps - turn - begin.x - begin.y;
  vec3 w = vec3(int(n) * begin + turn * own) / float(int(n) * steps);
  precise vec3 base = (inner[0] * w.x + inner[1] * w.y) + inner[2] * w.z;
  precise vec3 top = (outer[0] * w.x + outer[1] * w.y) + outer[2] * w.z;
  float alpha = float(words.x & 16777215u) / 16777215.0;
  precise vec3 p = base + (top - base) * alpha;
  precise vec4 clip = projection * vec4(p, 1.0);
  gl_Position = clip;
  float fibre = length(top - base), slab = float((part.z * 2654435761u) >> 16) / 65535.0;
  return Vertex(p, unpack_normal(words.y), vec3(own) / float(n), vec2(alpha, float(words.y >> 24) / 127.0 - 1.0),
                float(words.x >> 24) / 255.0, fibre * (alpha - 0.5), fibre * min(alpha, 1.0 - alpha), slab,
                vec4(begin, turn));
}
)";
/// How much of a pixel is line along the edges of a slab, 0 to 1, from its weights and Vertex::root; edges that are not
/// its root's are fainter. `reach`: half the width of a line and half a pixel. None where slabs are a few pixels.
inline constexpr std::string_view kSlabWires = R"(
float wire_along(vec3 weights, vec3 slope, float reach) {
  vec3 steps = weights / slope;
  return clamp(reach - min(steps.x, min(steps.y, steps.z)), 0.0, 1.0);
}
float slab_wire(vec3 weights, vec4 root, float reach) {
  vec3 slope = max(fwidth(weights), vec3(1e-6));
  float crowded = max(slope.x, max(slope.y, slope.z)), size = root.x + root.y + root.z + root.w;
  float own = wire_along(weights, slope, reach) * (1.0 - smoothstep(0.05, 0.25, crowded));
  float outer = wire_along(root.xyz + root.w * weights, slope, reach) * (1.0 - smoothstep(0.05, 0.25, crowded / size));
  return max(outer, 0.4 * own);
}
)";
/// With kPlace before it.
inline constexpr std::string_view kSurfaceVertex = R"(
out vec3 position;
out vec3 normal;
out vec3 weights;
out vec2 hollow_mask;
flat out vec4 root;
out float value;  // of the map, or n for the stretch
flat out uvec2 colour_tile;
layout(location = 2) uniform ivec4 modes;
void main() {
  Vertex v = place_vertex();
  position = v.position;
  normal = v.normal;
  weights = v.weights;
  root = v.root;
  hollow_mask = vec2(v.alpha_hollow.y, v.mask);
  value = modes.y == 1 ? v.height : modes.y == 2 ? v.clay : modes.y == 3 ? v.slab : float(data.y & 255u);
  colour_tile = data.zw;
}
)";
/// With kPlace before it: only where the surface is.
inline constexpr std::string_view kShadowVertex = R"(
void main() { place_vertex(); }
)";

/// With kSlabWires before it. What the picture shows at a pixel, before light: reflectance (square root of linear; a:
/// share of the highlight), normal, distance along the eye's axis (0: nothing).
inline constexpr std::string_view kSurfaceFragment =
    R"(layout(std430, binding = 2) readonly buffer Colours { uint colours[]; };
layout(location = 1) uniform vec3 base_colour;
layout(location = 2) uniform ivec4 modes;          // has colour, map, slab wires, two-sided
layout(location = 3) uniform vec4 ring;            // contact ring: centre, radius (0: none)
layout(location = 4) uniform vec4 map;             // lowest value, 1 / range, width of lines in sub-pixels,
                                                   // 1 / mean area of a micro-triangle
layout(location = 5) uniform vec2 shares;          // of the hollows, of the mask
layout(binding = 4) uniform sampler2D map_colours;
in vec3 position;
in vec3 normal;
in vec3 weights;
in vec2 hollow_mask;
flat in vec4 root;
in float value;
flat in uvec2 colour_tile;
layout(location = 0) out vec4 out_base;
layout(location = 1) out vec2 out_normal;
layout(location = 2) out float out_distance;
vec3 texel(uint m, uint i, uint j) {
  uint word = colours[colour_tile.x + j * (m + 1u) - (j * (j - 1u)) / 2u + i];
  return vec3(word & 255u, (word >> 8) & 255u, (word >> 16) & 255u) / 255.0;
}
vec3 lattice_colour() {
  uint m = colour_tile.y;
  vec2 at = max(weights.yz, vec2(0.0)) * float(m);
  uint i = min(uint(at.x), m - 1u), j = min(uint(at.y), m - 1u - i);
  vec2 f = at - vec2(i, j);
  if (f.x + f.y > 1.0 && i + j + 2u <= m)
    return texel(m, i + 1u, j + 1u) * (f.x + f.y - 1.0) + texel(m, i, j + 1u) * (1.0 - f.x) +
           texel(m, i + 1u, j) * (1.0 - f.y);
  return texel(m, i, j) * (1.0 - f.x - f.y) + texel(m, i + 1u, j) * f.x + texel(m, i, j + 1u) * f.y;
}
vec3 linear(vec3 c) {
  return mix(c / 12.92, pow((max(c, vec3(0.04045)) + 0.055) / 1.055, vec3(2.4)), step(vec3(0.04045), c));
}
vec2 pack_normal(vec3 n) {
  n /= abs(n.x) + abs(n.y) + abs(n.z);
  vec2 p = n.z < 0.0 ? (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0) : n.xy;
  return p * 0.5 + 0.5;
}
void main() {
  vec3 base;
  float shine = 1.0;
  if (modes.y != 0) {
    float shown = value;
    if (modes.y == 4) {
      vec2 across = dFdx(weights.yz), over = dFdy(weights.yz);
      float share = abs(across.x * over.y - across.y * over.x) * value * value;
      float area = length(cross(dFdx(position), dFdy(position)));
      shown = log2(max(area, 1e-30) / max(share, 1e-30) * map.w);
    }
    base = linear(texture(map_colours, vec2((shown - map.x) * map.y, 0.5)).rgb);
    shine = 0.5;
  } else {
    base = linear(clamp(modes.x != 0 ? lattice_colour() : base_colour, 0.0, 1.0));
    float hollow = hollow_mask.x * shares.x;
    base *= hollow > 0.0 ? 1.0 - 0.55 * hollow : 1.0 - 0.22 * hollow;
  }
  base *= 1.0 - 0.7 * hollow_mask.y * shares.y;
  if (modes.z != 0) {
    float line = slab_wire(weights, root, 0.55 * map.z + 0.5);
    base = mix(base, vec3(0.012), 0.9 * line);
    shine = mix(shine, 0.0, line);
  }
  if (ring.w > 0.0) {
    float away = distance(position, ring.xyz) - ring.w;
    float line = clamp(1.3 * map.z + 0.5 - abs(away) / max(fwidth(away), 1e-9), 0.0, 1.0);
    base = mix(base, vec3(1.0, 0.72, 0.05), line);
  }
  vec3 n = normalize(normal);
  if (modes.w != 0 && !gl_FrontFacing) n = -n;
  out_base = vec4(sqrt(clamp(base, 0.0, 1.0)), shine);
  out_normal = pack_normal(n);
  out_distance = 1.0 / gl_FragCoord.w;
}
)";

inline constexpr std::string_view kCoverageFragment = R"(layout(location = 0) out vec2 coverage;
void main() { coverage = vec2(gl_FrontFacing ? 1.0 : -1.0, 1.0); }
)";

inline constexpr std::string_view kSolidVertex = R"(layout(location = 0) in vec3 in_position;
layout(location = 1) in vec3 in_normal;
layout(location = 2) in vec3 in_colour;
layout(location = 0) uniform mat4 projection;
out vec3 position;
out vec3 normal;
out vec3 colour;
void main() {
  gl_Position = projection * vec4(in_position, 1.0);
  position = in_position;
  normal = in_normal;
  colour = in_colour * in_colour;
}
)";
inline constexpr std::string_view kSolidFragment = R"(in vec3 position;
in vec3 normal;
in vec3 colour;
layout(location = 0) out vec4 out_base;
layout(location = 1) out vec2 out_normal;
layout(location = 2) out float out_distance;
void main() {
  vec3 n = normalize(normal);
  n /= abs(n.x) + abs(n.y) + abs(n.z);
  vec2 p = n.z < 0.0 ? (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0) : n.xy;
  out_base = vec4(sqrt(colour), 1.0);
  out_normal = p * 0.5 + 0.5;
  out_distance = 1.0 / gl_FragCoord.w;
}
)";
/// For kVeilFragment, over light and over colours.
inline constexpr std::string_view kVeilLight = R"(
vec3 encode(vec3 light) { return light; }
)";
/// With kVeilLight before it. Solids blended over the lit picture: what is hidden, faint; the tool
/// sphere, clear in the middle and dense at its rim.
inline constexpr std::string_view kVeilFragment = R"(layout(location = 1) uniform vec3 eye;
layout(location = 2) uniform vec2 density;  // facing the eye, at the rim
in vec3 position;
in vec3 normal;
in vec3 colour;
layout(location = 0) out vec4 out_light;
void main() {
  float facing = abs(dot(normalize(normal), normalize(eye - position)));
  float a = mix(density.y, density.x, smoothstep(0.0, 0.75, facing));
  out_light = vec4(encode(colour * (0.35 + 0.65 * facing)) * a, a);
}
)";

inline constexpr std::string_view kScreenVertex =
    R"(void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }
)";

/// Unshadowed sky and ground.
inline constexpr std::string_view kAmbientFragment = R"(layout(binding = 0) uniform sampler2D base_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(location = 0) uniform vec3 up;
layout(location = 1) uniform vec3 sky;
layout(location = 2) uniform vec3 ground;
layout(location = 0) out vec4 out_light;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec3 base = texelFetch(base_map, pixel, 0).rgb;
  vec2 p = texelFetch(normal_map, pixel, 0).rg * 2.0 - 1.0;
  vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
  out_light = vec4(base * base * mix(ground, sky, 0.5 + 0.5 * dot(normalize(n), up)), 1.0);
}
)";

/// A batch of lights, each with its shadow map: diffuse reflection, and the highlight of a rough dielectric (GGX).
inline constexpr std::string_view kLightFragment =
    R"(layout(std140, binding = 0) uniform Batch { vec4 rows[24]; vec4 towards[8]; vec4 colour[8]; };
layout(binding = 0) uniform sampler2D base_map;
layout(binding = 1) uniform sampler2D normal_map;
layout(binding = 2) uniform sampler2D distance_map;
layout(binding = 3) uniform sampler2DArrayShadow shadow_map;
layout(location = 0) uniform vec3 eye;
layout(location = 1) uniform vec3 ray[3];  // of the lower left sub-pixel's corner, and per sub-pixel right and up
layout(location = 4) uniform int count;
layout(location = 5) uniform float spread;  // of a pixel's look-ups over the surface, model units
layout(location = 0) out vec4 out_light;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 base = texelFetch(base_map, pixel, 0);
  base.rgb *= base.rgb;
  vec2 q = texelFetch(normal_map, pixel, 0).rg * 2.0 - 1.0;
  vec3 n = vec3(q, 1.0 - abs(q.x) - abs(q.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
  n = normalize(n);
  vec3 along = ray[0] + ray[1] * gl_FragCoord.x + ray[2] * gl_FragCoord.y;
  vec3 p = eye + along * texelFetch(distance_map, pixel, 0).r;
  vec3 v = -normalize(along);
  // The sub-pixels of a pixel ask at places around their own, turned from pixel to pixel and from light to light: their
  // mean is a soft edge. Staying in the surface's plane, they need no more bias than one look-up.
  vec3 across = normalize(cross(n, abs(n.x) < 0.6 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0)));
  vec2 corner = vec2(pixel & 1) - 0.5;
  float turn = 6.2831853 * fract(52.9829189 * fract(dot(vec2(pixel >> 1), vec2(0.06711056, 0.00583715))));
  vec2 shift = spread * vec2(cos(turn) * corner.x - sin(turn) * corner.y, sin(turn) * corner.x + cos(turn) * corner.y);
  vec3 beside = cross(n, across);
  // By the golden share of the quarter turn after which the four corners are the same again.
  const mat2 next = mat2(0.56467, 0.82532, -0.82532, 0.56467);
  vec3 light = vec3(0.0);
  for (int k = 0; k < count; ++k) {
    vec3 l = towards[k].xyz;
    float facing = dot(n, l);
    vec3 asked = p + across * shift.x + beside * shift.y;
    shift = next * shift;
    vec4 at = vec4(asked + n * (towards[k].w * (1.2 + 1.6 * (1.0 - clamp(facing, 0.0, 1.0)))), 1.0);
    vec3 map = vec3(dot(rows[3 * k], at), dot(rows[3 * k + 1], at), dot(rows[3 * k + 2], at));
    float lit = texture(shadow_map, vec4(map.xy, float(k), map.z));
    vec3 h = normalize(l + v);
    float nh = clamp(dot(n, h), 0.0, 1.0), lh = clamp(dot(l, h), 0.0, 1.0);
    const float rough = 0.40, a2 = rough * rough * rough * rough;
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float bend = 1.0 - lh;
    float fresnel = 0.04 + 0.36 * bend * bend * bend * bend * bend;
    float gloss = fresnel * a2 / (4.0 * d * d * max(lh * lh, 0.1) * (rough + 0.5));
    light += colour[k].rgb * (max(facing, 0.0) * lit) * (base.rgb + gloss * base.a);
  }
  out_light = vec4(light, 0.0);
}
)";

/// What the model takes of the light on the floor: for the soft boxes (r) and for the sky (b), each with the radius
/// over which its lights must be blurred into one (g, a), weighted alike.
inline constexpr std::string_view kFloorFragment =
    R"(layout(std140, binding = 0) uniform Batch { vec4 rows[24]; vec4 towards[8]; vec4 colour[8]; };
layout(binding = 3) uniform sampler2DArray shadow_map;
layout(location = 0) uniform vec3 corner;
layout(location = 1) uniform vec3 side[2];
layout(location = 3) uniform vec4 shares[8];  // soft box, sky, radius per depth
layout(location = 11) uniform int count;
layout(location = 0) out vec4 taken;
void main() {
  vec4 at = vec4(corner + side[0] * gl_FragCoord.x + side[1] * gl_FragCoord.y, 1.0);
  taken = vec4(0.0);
  for (int k = 0; k < count; ++k) {
    vec3 map = vec3(dot(rows[3 * k], at), dot(rows[3 * k + 1], at), dot(rows[3 * k + 2], at));
    float first = textureLod(shadow_map, vec3(map.xy, float(k)), 0.0).r, above = map.z - first;
    if (first < 1.0 && above > 0.002 && map.xy == clamp(map.xy, 0.0, 1.0)) {
      float radius = above * shares[k].z;
      taken += vec4(shares[k].x, shares[k].x * radius, shares[k].y, shares[k].y * radius);
    }
  }
}
)";
/// Two passes: first the radii, averaged over the surroundings; then the light, over those radii.
inline constexpr std::string_view kFloorBlurFragment = R"(layout(binding = 0) uniform sampler2D taken_map;
layout(binding = 1) uniform sampler2D radius_map;
layout(location = 0) uniform ivec2 mode;  // 0: radii, 1: light; size of the map
layout(location = 0) out vec4 result;
void main() {
  vec2 texel = 1.0 / vec2(float(mode.y)), at = gl_FragCoord.xy * texel;
  float around = float(mode.y) / 24.0;
  vec4 radii = texture(radius_map, at);
  vec4 sum = vec4(0.0);
  float total = 0.0;
  const int kTaps = 40;
  for (int k = 0; k < kTaps; ++k) {
    float r = sqrt((float(k) + 0.5) / float(kTaps)), turn = 2.39996323 * float(k);
    vec2 d = r * vec2(cos(turn), sin(turn)) * texel;
    float w = 1.0 - 0.7 * r * r;
    total += w;
    if (mode.x == 0) sum += w * texture(taken_map, at + d * around);
    else sum += w * vec4(texture(taken_map, at + d * radii.x).r, 0.0, texture(taken_map, at + d * radii.y).b, 0.0);
  }
  sum /= total;
  vec2 radius = sum.ga / max(sum.rb, vec2(1e-5));
  if (mode.x == 0) result = vec4(clamp(radius, vec2(1.0, 1.5), vec2(1.6, 2.5) * around), 0.0, 0.0);
  else result = vec4(sum.r, sum.b, 0.0, 0.0);
}
)";

/// The film curve, and what lies behind the model: floor and backdrop.
inline constexpr std::string_view kBackdrop = R"(layout(binding = 1) uniform sampler2D floor_map;
layout(location = 0) uniform vec3 eye;
layout(location = 1) uniform vec3 ray[3];        // as for the lights, per pixel
layout(location = 4) uniform ivec4 modes;        // supersample, ground, first pixel x, y
layout(location = 5) uniform vec4 size;          // picture width, height
layout(location = 6) uniform vec4 plane;         // up, height of the floor
layout(location = 7) uniform vec3 floor_axes[2]; // in shares of the floor map
layout(location = 9) uniform vec4 floor_middle;  // middle of the floor map; half its edge
vec3 film(vec3 x) {
  vec3 p = pow(max(x * 0.94, vec3(0.0)), vec3(1.25));
  return p / (p * 0.93 + 0.56);
}
vec3 encode(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(vec3(0.0031308), c));
}
vec3 behind(vec2 pixel) {
  vec2 at = (pixel + vec2(modes.zw)) / size.xy * 2.0 - 1.0;
  if (modes.y == 0) return vec3(0.145, 0.150, 0.160);
  at.x *= min(size.x / size.y, 2.0) * 0.62;
  at.y -= 0.12;
  vec3 back = mix(vec3(0.030, 0.033, 0.040), vec3(0.185, 0.195, 0.212), exp(-1.5 * dot(at, at)));
  vec3 d = ray[0] + ray[1] * pixel.x + ray[2] * pixel.y;
  float fall = dot(d, plane.xyz), height = dot(eye, plane.xyz) - plane.w;
  if (fall > -1e-6 || height <= 0.0) return back;
  vec3 hit = eye - d * (height / fall);
  vec3 from = (hit - floor_middle.xyz) / floor_middle.w;
  float away2 = dot(from, from);
  vec2 place = vec2(dot(floor_axes[0], from), dot(floor_axes[1], from));
  vec2 taken = texture(floor_map, place * 0.5 + 0.5).rg;
  float edge = max(abs(place.x), abs(place.y));
  float light = 1.0 - (taken.r + taken.g) * (1.0 - smoothstep(0.8, 1.0, edge));
  vec3 ground = vec3(0.33, 0.326, 0.32) * (0.14 + 0.86 * exp(-0.6 * away2));
  ground *= mix(vec3(0.90, 0.94, 1.02), vec3(1.0), light) * pow(max(light, 0.0), 1.25);
  return mix(back, ground, exp(-0.16 * away2));
}
)";
/// From light to the picture: film curve, sub-pixels into pixels. With kBackdrop before it.
inline constexpr std::string_view kResolveFragment = R"(
layout(binding = 0) uniform sampler2D light_map;
layout(location = 0) out vec4 out_colour;
void main() {
  ivec2 first = ivec2(gl_FragCoord.xy) * modes.x;
  vec4 sum = vec4(0.0);
  for (int y = 0; y < modes.x; ++y)
    for (int x = 0; x < modes.x; ++x) {
      vec4 l = texelFetch(light_map, first + ivec2(x, y), 0);
      // Each sub-pixel goes through the film curve by itself: bright edges stay smooth.
      if (l.a > 0.0) sum += vec4(film(l.rgb / l.a) * l.a, l.a);
    }
  sum /= float(modes.x * modes.x);
  vec3 colour = sum.rgb;
  if (sum.a < 1.0) colour += film(behind(gl_FragCoord.xy)) * (1.0 - sum.a);
  // Half a step of noise, the same every time, against bands in the backdrop.
  vec2 at = gl_FragCoord.xy + vec2(modes.zw);
  float noise = fract(52.9829189 * fract(dot(at, vec2(0.06711056, 0.00583715)))) - 0.5;
  out_colour = vec4(encode(colour) + noise / 255.0 * (modes.y != 0 ? 1.0 : 0.0), 1.0);
}
)";

}  // namespace relief::detail
