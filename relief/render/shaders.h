// The programs that run on the graphics driver, in GLSL 4.50; make_program() writes the line with the version.
#pragma once

#include <string_view>

namespace relief::detail {

/// Lights in one pass over the picture; the arrays below have this size.
inline constexpr int kBatch = 8;

/// Position on the fibre, from the lattice. A sample on a wall has one weight of zero, so its sum is the same bits in
/// both slabs, whatever the order of their corners; `precise` keeps it so.
inline constexpr std::string_view kPlace = R"(
layout(std430, binding = 0) readonly buffer Samples { uvec2 samples[]; };
layout(std430, binding = 1) readonly buffer Places { uint places[]; };
layout(location = 0) in vec3 inner[3];  // of the slab
layout(location = 3) in vec3 outer[3];
layout(location = 6) in uvec4 data;     // first sample, n, first colour, m
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
  float mask, clay, slab;  // clay: to the nearer end of the fibre, a length; slab: a number in 0..1 of its own
};
Vertex place_vertex() {
  uint place = places[gl_VertexID];
  uvec2 word = samples[data.x + uint(gl_VertexID)];
  uint i = place & 255u, j = place >> 8;
  vec3 w = vec3(data.y - i - j, i, j) / float(data.y);
  precise vec3 base = (inner[0] * w.x + inner[1] * w.y) + inner[2] * w.z;
  precise vec3 top = (outer[0] * w.x + outer[1] * w.y) + outer[2] * w.z;
  float alpha = uintBitsToFloat(word.x);
  precise vec3 p = base + (top - base) * alpha;
  precise vec4 clip = projection * vec4(p, 1.0);
  gl_Position = clip;
  float clay = length(top - base) * min(alpha, 1.0 - alpha), slab = fract(float(data.x) * 0.61803399);
  return Vertex(p, unpack_normal(word.y), w, vec2(alpha, float(word.y >> 24) / 127.0 - 1.0), 0.0, clay, slab);
}
)";
/// With kPlace before it.
inline constexpr std::string_view kSurfaceVertex = R"(
out vec3 position;
out vec3 normal;
out vec3 weights;
out vec2 alpha_hollow;
flat out uvec2 colour_tile;
void main() {
  Vertex v = place_vertex();
  position = v.position;
  normal = v.normal;
  weights = v.weights;
  alpha_hollow = v.alpha_hollow;
  colour_tile = data.zw;
}
)";
/// With kPlace before it: only where the surface is.
inline constexpr std::string_view kShadowVertex = R"(
void main() { place_vertex(); }
)";

/// What the picture shows at a pixel, before light: reflectance (square root of linear; a: share of the highlight),
/// normal, distance along the eye's axis (0: nothing).
inline constexpr std::string_view kSurfaceFragment =
    R"(layout(std430, binding = 2) readonly buffer Colours { uint colours[]; };
layout(location = 1) uniform vec3 base_colour;
layout(location = 2) uniform ivec4 modes;          // has colour, heat map, slab wires, two-sided
layout(location = 3) uniform vec4 ring;            // contact ring: centre, radius (0: none)
layout(location = 4) uniform vec4 heat_range;      // lowest alpha, 1 / range, width of lines in sub-pixels
layout(location = 5) uniform vec3 heat[9];
in vec3 position;
in vec3 normal;
in vec3 weights;
in vec2 alpha_hollow;
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
    float t = clamp((alpha_hollow.x - heat_range.x) * heat_range.y, 0.0, 1.0) * 8.0;
    int k = min(int(t), 7);
    base = linear(mix(heat[k], heat[k + 1], t - float(k)));
    if (abs(alpha_hollow.x - 0.5) > 0.45) base = linear(vec3(0.95, 0.25, 0.85));  // kAtEnd
    shine = 0.5;
  } else {
    base = linear(clamp(modes.x != 0 ? lattice_colour() : base_colour, 0.0, 1.0));
    float hollow = alpha_hollow.y;
    base *= hollow > 0.0 ? 1.0 - 0.55 * hollow : 1.0 - 0.22 * hollow;
  }
  if (modes.z != 0) {
    vec3 slope = max(fwidth(weights), vec3(1e-6));
    vec3 steps = weights / slope;
    float nearest = min(steps.x, min(steps.y, steps.z));
    float crowded = smoothstep(0.05, 0.25, max(slope.x, max(slope.y, slope.z)));
    float line = clamp(0.55 * heat_range.z + 0.5 - nearest, 0.0, 1.0) * (1.0 - crowded);
    base = mix(base, vec3(0.012), 0.9 * line);
    shine = mix(shine, 0.0, line);
  }
  if (ring.w > 0.0) {
    float away = distance(position, ring.xyz) - ring.w;
    float line = clamp(1.3 * heat_range.z + 0.5 - abs(away) / max(fwidth(away), 1e-9), 0.0, 1.0);
    base = mix(base, vec3(1.0, 0.72, 0.05), line);
  }
  vec3 n = normalize(normal);
  if (modes.w != 0 && !gl_FrontFacing) n = -n;
  out_base = vec4(sqrt(clamp(base, 0.0, 1.0)), shine);
  out_normal = pack_normal(n);
  out_distance = 1.0 / gl_FragCoord.w;
}
)";

inline constexpr std::string_view kCoverageFragment = R"(in vec3 position;
in vec3 normal;
in vec3 weights;
in vec2 alpha_hollow;
flat in uvec2 colour_tile;
layout(location = 0) out vec2 coverage;
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
/// With kVeilLight or kQuickLight before it. Solids blended over the lit picture: what is hidden, faint; the tool
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
  // The sub-pixels of a pixel ask at places around their own, turned from pixel to pixel: their mean is a soft edge.
  // Staying in the surface's plane, they need no more bias than one look-up.
  vec3 across = normalize(cross(n, abs(n.x) < 0.6 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0)));
  vec2 corner = vec2(pixel & 1) - 0.5;
  float turn = 6.2831853 * fract(52.9829189 * fract(dot(vec2(pixel >> 1), vec2(0.06711056, 0.00583715))));
  vec2 shift = spread * vec2(cos(turn) * corner.x - sin(turn) * corner.y, sin(turn) * corner.x + cos(turn) * corner.y);
  vec3 asked = p + across * shift.x + cross(n, across) * shift.y;
  vec3 light = vec3(0.0);
  for (int k = 0; k < count; ++k) {
    vec3 l = towards[k].xyz;
    float facing = dot(n, l);
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

/// The quick frame goes over the surface once: one key light with a shadow, a fill and a rim without, sky and bounce.
/// Its programs are compiled with what they need and nothing else: HEAT, COLOUR, WIRES, RING, TWO_SIDED, SMALL.
/// The light that a place gives back, and the film curve with the sRGB curve after it as one quotient in the square
/// root of light (within 0.9 % of the full picture's).
inline constexpr std::string_view kQuickLight = R"(
layout(location = 16) uniform vec4 towards[3];  // key, fill, rim; w: shadow texel
layout(location = 19) uniform vec3 strength[3];
layout(location = 22) uniform vec3 up;
layout(location = 23) uniform vec3 ambient[2];  // mean of sky and ground, half their difference
layout(location = 25) uniform vec4 half_way;    // between key and eye; strength of the highlight
vec3 encode(vec3 light) {
  vec3 s = sqrt(light);
  return (light * 5.5706 + s * 0.16275) / (light * 4.7722 + s * 1.22847 + 1.0);
}
vec3 lit_colour(vec3 base, vec3 n, float lit) {
  float nh = max(dot(n, half_way.xyz), 0.0);
  float d = nh * nh * -0.92 + 1.0;  // rougher than in the full picture: one light stands for a soft box
  float key = max(dot(n, towards[0].xyz), 0.0) * lit;
  vec3 rest = strength[1] * max(dot(n, towards[1].xyz), 0.0) + strength[2] * max(dot(n, towards[2].xyz), 0.0) +
              ambient[0] + ambient[1] * dot(n, up);
  return encode(base * (strength[0] * key + rest) + strength[0] * (key * half_way.w / (d * d)));
}
)";
/// Reflectance, linear.
inline constexpr std::string_view kQuickColour = R"(
layout(location = 1) uniform vec3 base_colour;  // linear, where there is no other
#if defined(HEAT)
layout(location = 4) uniform vec4 heat_range;  // lowest alpha, 1 / range
layout(location = 30) uniform vec3 heat[9];    // linear
vec3 surface_colour(vec2 weights, uvec2 tile, float tint) {
  float t = clamp((tint - heat_range.x) * heat_range.y, 0.0, 1.0) * 8.0;
  int k = min(int(t), 7);
  if (abs(tint - 0.5) > 0.45) return vec3(0.888, 0.051, 0.693);  // kAtEnd, linear
  return mix(heat[k], heat[k + 1], t - float(k));
}
#elif defined(COLOUR)
layout(std430, binding = 2) readonly buffer Colours { uint colours[]; };
vec3 texel(uvec2 tile, uvec2 at) {
  uint word = colours[tile.x + at.y * (tile.y + 1u) - (at.y * (at.y - 1u)) / 2u + at.x];
  return vec3(word & 255u, (word >> 8) & 255u, (word >> 16) & 255u);
}
// Of the cell's two triangles the one that holds the place: its right-angled corner and the two beside it.
vec3 surface_colour(vec2 weights, uvec2 tile, float tint) {
  uint m = tile.y;
  vec2 at = max(weights, vec2(0.0)) * float(m);
  uint i = min(uint(at.x), m - 1u), j = min(uint(at.y), m - 1u - i);
  vec2 f = at - vec2(i, j);
  bool upper = f.x + f.y > 1.0 && i + j + 2u <= m;
  vec2 g = upper ? 1.0 - f.yx : f;
  vec3 c = texel(tile, uvec2(i, j) + (upper ? 1u : 0u)) * (1.0 - g.x - g.y);
  c += texel(tile, uvec2(i + 1u, j)) * g.x + texel(tile, uvec2(i, j + 1u)) * g.y;
  c /= 255.0;
  return c * (c * (c * 0.3053 + 0.6822) + 0.0125) * tint;  // sRGB to linear, within half a step of 8 bits
}
#else
vec3 surface_colour(vec2 weights, uvec2 tile, float tint) { return base_colour * tint; }
#endif
)";
/// With kPlace, kQuickLight and kQuickColour before it. Where triangles are SMALL, light and colour are found at their
/// corners: a software driver shades a small triangle's surroundings with it.
inline constexpr std::string_view kQuickVertex = R"(
layout(location = 8) uniform vec4 shadow_rows[3];
layout(location = 11) uniform float shadow_texel;
out vec3 shadow_place;
#ifdef SMALL
out vec3 dark;
out vec3 bright;
#else
out vec4 normal_tint;
#endif
#if defined(WIRES) || !defined(SMALL)
out vec2 weights;
#endif
#ifndef SMALL
flat out uvec2 colour_tile;
#endif
#ifdef RING
out vec3 position;
#endif
void main() {
  Vertex v = place_vertex();
  float facing = clamp(dot(v.normal, towards[0].xyz), 0.0, 1.0);
  vec4 at = vec4(v.position + v.normal * (shadow_texel * (1.5 + 2.0 * (1.0 - facing))), 1.0);
  shadow_place = vec3(dot(shadow_rows[0], at), dot(shadow_rows[1], at), dot(shadow_rows[2], at));
#ifdef HEAT
  float tint = v.alpha_hollow.x;
#else
  float hollow = v.alpha_hollow.y, tint = hollow > 0.0 ? 1.0 - 0.55 * hollow : 1.0 - 0.22 * hollow;
#endif
#ifdef SMALL
  vec3 base = surface_colour(v.weights.yz, data.zw, tint);
  dark = lit_colour(base, v.normal, 0.0);
  bright = lit_colour(base, v.normal, 1.0);
#else
  normal_tint = vec4(v.normal, tint);
  colour_tile = data.zw;
#endif
#if defined(WIRES) || !defined(SMALL)
  weights = v.weights.yz;
#endif
#ifdef RING
  position = v.position;
#endif
}
)";
/// With kQuickLight and kQuickColour before it.
inline constexpr std::string_view kQuickFragment = R"(
layout(binding = 3) uniform sampler2DShadow shadow_map;
layout(location = 2) uniform float line_width;  // pixels
layout(location = 3) uniform vec4 ring;
in vec3 shadow_place;
#ifdef SMALL
in vec3 dark;
in vec3 bright;
#else
in vec4 normal_tint;
flat in uvec2 colour_tile;
#endif
#if defined(WIRES) || !defined(SMALL)
in vec2 weights;
#endif
#ifdef RING
in vec3 position;
#endif
layout(location = 0) out vec4 out_colour;
void main() {
  float lit = texture(shadow_map, shadow_place);
#ifdef SMALL
  vec3 colour = mix(dark, bright, lit);
#else
  vec3 n = normalize(normal_tint.xyz);
#ifdef TWO_SIDED
  if (!gl_FrontFacing) n = -n;
#endif
  vec3 colour = lit_colour(surface_colour(weights, colour_tile, normal_tint.w), n, lit);
#endif
#ifdef WIRES
  vec3 all = vec3(1.0 - weights.x - weights.y, weights);
  vec3 slope = max(fwidth(all), vec3(1e-6));
  vec3 steps = all / slope;
  float crowded = smoothstep(0.05, 0.25, max(slope.x, max(slope.y, slope.z)));
  float wire = clamp(0.55 * line_width + 0.5 - min(steps.x, min(steps.y, steps.z)), 0.0, 1.0) * (1.0 - crowded);
  colour *= 1.0 - 0.85 * wire;
#endif
#ifdef RING
  float away = distance(position, ring.xyz) - ring.w;
  float line = clamp(1.3 * line_width + 0.5 - abs(away) / max(fwidth(away), 1e-9), 0.0, 1.0);
  colour = mix(colour, vec3(0.97, 0.85, 0.16), line);
#endif
  out_colour = vec4(colour, 1.0);
}
)";
/// With kQuickLight before it.
inline constexpr std::string_view kQuickSolidFragment = R"(
in vec3 position;
in vec3 normal;
in vec3 colour;
layout(location = 0) out vec4 out_colour;
void main() { out_colour = vec4(lit_colour(colour, normalize(normal), 1.0), 1.0); }
)";
/// What the model takes of the key light on the floor, softer the farther from what casts the shadow, and of the sky.
inline constexpr std::string_view kQuickFloorFragment = R"(
layout(binding = 3) uniform sampler2D shadow_map;
layout(location = 0) uniform vec3 corner;
layout(location = 1) uniform vec3 side[2];
layout(location = 3) uniform vec4 rows[3];
layout(location = 6) uniform float widen;  // share of the shadow map over which a light spreads, per depth
layout(location = 7) uniform vec4 under;   // the model's footprint on the map: middle, half edges
layout(location = 0) out vec4 taken;
void main() {
  vec4 at = vec4(corner + side[0] * gl_FragCoord.x + side[1] * gl_FragCoord.y, 1.0);
  vec3 map = vec3(dot(rows[0], at), dot(rows[1], at), dot(rows[2], at));
  const int kTaps = 24;
  float height = 0.0, hits = 0.0;
  for (int k = 0; k < kTaps; ++k) {
    float r = 0.10 * sqrt((float(k) + 0.5) / float(kTaps)), turn = 2.39996323 * float(k);
    float first = textureLod(shadow_map, map.xy + r * vec2(cos(turn), sin(turn)), 0.0).r;
    if (first < min(map.z - 0.002, 1.0)) {
      height += map.z - first;
      hits += 1.0;
    }
  }
  float radius = max(0.006, min(widen * height / max(hits, 1.0), 0.10)), dark = 0.0;
  for (int k = 0; k < kTaps; ++k) {
    float r = radius * sqrt((float(k) + 0.5) / float(kTaps)), turn = 2.39996323 * float(k);
    float first = textureLod(shadow_map, map.xy + r * vec2(cos(turn), sin(turn)), 0.0).r;
    dark += first < min(map.z - 0.002, 1.0) ? 1.0 / float(kTaps) : 0.0;
  }
  vec2 from = (gl_FragCoord.xy - under.xy) / under.zw;
  taken = vec4(0.55 * dark, 0.40 * exp(-1.2 * dot(from, from)), 0.0, 0.0);
}
)";
/// Floor and backdrop at a fraction of the picture's size. With kBackdrop before it.
inline constexpr std::string_view kQuickBackdropFragment = R"(
layout(location = 0) out vec4 out_colour;
void main() { out_colour = vec4(encode(film(behind(gl_FragCoord.xy))), 1.0); }
)";

}  // namespace relief::detail
