/** Draws one texel a vertex into a texture. */
export const VERTEX = "void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }";

/** x = rest + sum over k of z_k B_k, one texel a vertex. */
export const POSITIONS = `
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray basis;
uniform sampler2D rest;
uniform sampler2D coordinates;
uniform int columns;
out vec4 result;
void main() {
  ivec2 texel = ivec2(gl_FragCoord.xy);
  vec3 x = texelFetch(rest, texel, 0).xyz;
  for (int k = 0; k < columns; ++k)
    x += texelFetch(coordinates, ivec2(k, 0), 0).r * texelFetch(basis, ivec3(texel, k), 0).xyz;
  result = vec4(x, 1.0);
}`;

/** Normals of the deformed surface: the sum over a vertex's triangles, weighted by area. */
export const NORMALS = `
precision highp float;
uniform sampler2D positions;
uniform sampler2D rings;
uniform sampler2D pairs;
uniform int side;
out vec4 result;
vec3 at(float vertex) { int v = int(vertex); return texelFetch(positions, ivec2(v % side, v / side), 0).xyz; }
void main() {
  ivec2 texel = ivec2(gl_FragCoord.xy);
  vec3 x = texelFetch(positions, texel, 0).xyz;
  vec2 ring = texelFetch(rings, texel, 0).rg;
  int width = textureSize(pairs, 0).x;
  vec3 normal = vec3(0.0);
  for (int i = 0; i < int(ring.y); ++i) {
    int j = int(ring.x) + i;
    vec2 pair = texelFetch(pairs, ivec2(j % width, j / width), 0).rg;
    normal += cross(at(pair.x) - x, at(pair.y) - x);
  }
  result = vec4(normal / max(length(normal), 1e-30), 0.0);
}`;

/** Vertices of a carried surface: weighted sums of four nodes' positions. */
export const CARRIED = `
precision highp float;
uniform sampler2D nodes;
uniform sampler2D corners;
uniform sampler2D weights;
uniform int nodeSide;
out vec4 result;
vec3 at(float node) { int n = int(node + 0.5); return texelFetch(nodes, ivec2(n % nodeSide, n / nodeSide), 0).xyz; }
void main() {
  ivec2 texel = ivec2(gl_FragCoord.xy);
  vec4 corner = texelFetch(corners, texel, 0);
  vec4 weight = texelFetch(weights, texel, 0);
  result = vec4(weight.x * at(corner.x) + weight.y * at(corner.y) + weight.z * at(corner.z) + weight.w * at(corner.w), 1.0);
}`;
