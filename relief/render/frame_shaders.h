// The programs of frames, in GLSL 4.50. They are compiled with what a frame needs and nothing else, as a software
// driver pays for branches that are not taken. Features: BAKED (the material in its own colour), COLOUR, MAP, STRETCH,
// CAVITY, MASK, WIRES, TWO_SIDED, CORNERS (colours are found at the corners of triangles), MESH (plain triangles, no
// slabs).
#pragma once

#include <string_view>

namespace relief::detail {

/// Colour by normal in view space, albedo (linear) and shade; in whichever stage finds colours.
inline constexpr std::string_view kFrameLight = R"(
layout(binding = 0) uniform sampler2D matcap;
vec3 lit(vec3 n, vec3 albedo, float shade) {
  vec4 m = textureLod(matcap, n.xy * 0.5 + 0.5, 0.0);
#ifdef BAKED
  return m.rgb * shade;
#else
  vec3 light = albedo * (4.0 * shade * shade) * (m.rgb * m.rgb) + m.a * m.a;
  vec3 s = sqrt(light);
  return (light * 5.5706 + s * 0.16275) / (light * 4.7722 + s * 1.22847 + 1.0);
#endif
}
vec3 linear(vec3 c) { return c * (c * (c * 0.3053 + 0.6822) + 0.0125); }  // sRGB, within half a step of 8 bits
)";

/// Albedo, linear, by place and value of the map.
inline constexpr std::string_view kFrameAlbedo = R"(
layout(location = 5) uniform vec3 base_colour;  // linear
#if defined(MAP)
layout(binding = 1) uniform sampler2D map_colours;
vec3 albedo_at(vec2 weights, uvec2 tile, float value) {
  return linear(textureLod(map_colours, vec2(value, 0.5), 0.0).rgb);
}
#elif defined(COLOUR) && !defined(MESH)
layout(std430, binding = 2) readonly buffer Colours { uint colours[]; };
vec3 texel(uvec2 tile, uvec2 at) {
  uint word = colours[tile.x + at.y * (tile.y + 1u) - (at.y * (at.y - 1u)) / 2u + at.x];
  return vec3(word & 255u, (word >> 8) & 255u, (word >> 16) & 255u);
}
// Of the cell's two triangles the one that holds the place: its right-angled corner and the two beside it.
vec3 albedo_at(vec2 weights, uvec2 tile, float value) {
  uint m = tile.y;
  vec2 at = max(weights, vec2(0.0)) * float(m);
  uint i = min(uint(at.x), m - 1u), j = min(uint(at.y), m - 1u - i);
  vec2 f = at - vec2(i, j);
  bool upper = f.x + f.y > 1.0 && i + j + 2u <= m;
  vec2 g = upper ? 1.0 - f.yx : f;
  vec3 c = texel(tile, uvec2(i, j) + (upper ? 1u : 0u)) * (1.0 - g.x - g.y);
  c += texel(tile, uvec2(i + 1u, j)) * g.x + texel(tile, uvec2(i, j + 1u)) * g.y;
  return linear(c / 255.0);
}
#else
vec3 albedo_at(vec2 weights, uvec2 tile, float value) { return base_colour; }
#endif
)";

/// With kPlace, kFrameLight and kFrameAlbedo before it.
inline constexpr std::string_view kFrameVertex = R"(
layout(location = 1) uniform vec3 axes[3];  // of the view: right, up, to the eye
layout(location = 4) uniform vec3 map;      // lowest value, 1 / range, which map
#ifdef CORNERS
out vec3 colour;
#else
out vec4 normal_shade;
flat out uvec2 colour_tile;
out float value;
#endif
#if defined(WIRES) || !defined(CORNERS)
out vec2 weights;
#endif
#ifdef WIRES
flat out vec4 root;
#endif
#ifdef STRETCH
out vec3 position;
flat out float intervals;
#endif
void main() {
  Vertex v = place_vertex();
  vec3 n = vec3(dot(v.normal, axes[0]), dot(v.normal, axes[1]), dot(v.normal, axes[2]));
  float shade = 1.0;
#ifdef CAVITY
  float hollow = v.alpha_hollow.y;
  shade = hollow > 0.0 ? 1.0 - 0.30 * hollow : 1.0 - 0.10 * hollow;
#endif
#ifdef MASK
  shade *= 1.0 - 0.55 * v.mask;
#endif
  float shown = 0.0;
#if defined(MAP) && !defined(STRETCH)
  shown = ((map.z == 1.0 ? v.height : map.z == 2.0 ? v.clay : v.slab) - map.x) * map.y;
#endif
#ifdef CORNERS
  colour = lit(n, albedo_at(v.weights.yz, data.zw, shown), shade);
#else
  normal_shade = vec4(n, shade);
  colour_tile = data.zw;
  value = shown;
#endif
#if defined(WIRES) || !defined(CORNERS)
  weights = v.weights.yz;
#endif
#ifdef WIRES
  root = v.root;
#endif
#ifdef STRETCH
  position = v.position;
  intervals = float(data.y & 255u);
#endif
}
)";

/// With kFrameLight, kFrameAlbedo and kSlabWires before it.
inline constexpr std::string_view kFrameFragment = R"(
layout(location = 6) uniform float line_width;  // pixels
layout(location = 7) uniform vec2 stretch;      // 1 / mean area of a micro-triangle; 1 / range in octaves
#ifdef CORNERS
in vec3 colour;
#else
in vec4 normal_shade;
flat in uvec2 colour_tile;
in float value;
#endif
#if defined(WIRES) || !defined(CORNERS)
in vec2 weights;
#endif
#ifdef WIRES
flat in vec4 root;
#endif
#ifdef STRETCH
in vec3 position;
flat in float intervals;
#endif
layout(location = 0) out vec4 out_colour;
void main() {
#ifdef CORNERS
  vec3 c = colour;
#else
  vec3 n = normalize(normal_shade.xyz);
#ifdef TWO_SIDED
  if (!gl_FrontFacing) n = -n;
#endif
  float shown = value;
#ifdef STRETCH
  float share = abs(dFdx(weights.x) * dFdy(weights.y) - dFdx(weights.y) * dFdy(weights.x)) * intervals * intervals;
  float area = length(cross(dFdx(position), dFdy(position)));
  shown = log2(max(area, 1e-30) / max(share, 1e-30) * stretch.x) * stretch.y + 0.5;
#endif
  vec3 c = lit(n, albedo_at(weights, colour_tile, shown), normal_shade.w);
#endif
#ifdef WIRES
  c *= 1.0 - 0.75 * slab_wire(vec3(1.0 - weights.x - weights.y, weights), root, 0.5 * line_width + 0.5);
#endif
  out_colour = vec4(c, 1.0);
}
)";

/// Plain triangles. Before kFrameLight and kFrameAlbedo.
inline constexpr std::string_view kMeshVertex = R"(
layout(location = 0) in vec3 in_position;
layout(location = 1) in vec4 in_normal;
layout(location = 2) in vec4 in_colour;  // a: hollow
layout(location = 0) uniform mat4 projection;
layout(location = 1) uniform vec3 axes[3];
out vec4 normal_shade;
out vec3 tint;
void main() {
  precise vec4 clip = projection * vec4(in_position, 1.0);
  gl_Position = clip;
  float hollow = in_colour.a * 2.0 - 1.0, shade = 1.0;
#ifdef CAVITY
  shade = hollow > 0.0 ? 1.0 - 0.30 * hollow : 1.0 - 0.10 * hollow;
#endif
  normal_shade = vec4(dot(in_normal.xyz, axes[0]), dot(in_normal.xyz, axes[1]), dot(in_normal.xyz, axes[2]), shade);
  tint = in_colour.rgb;
}
)";
/// With kFrameLight and kFrameAlbedo before it.
inline constexpr std::string_view kMeshFragment = R"(
in vec4 normal_shade;
in vec3 tint;
layout(location = 0) out vec4 out_colour;
void main() {
  vec3 n = normalize(normal_shade.xyz);
  if (!gl_FrontFacing) n = -n;
#ifdef COLOUR
  vec3 albedo = linear(tint);
#else
  vec3 albedo = base_colour;
#endif
  out_colour = vec4(lit(n, albedo, normal_shade.w), 1.0);
}
)";

}  // namespace relief::detail
