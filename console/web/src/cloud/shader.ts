/// How points are shown; the index is the shader's `mode`.
export const kModes = ["colour", "intensity", "height", "quality", "sigma", "exposure", "moving"] as const;
export type Mode = (typeof kModes)[number];

export const vertexShader = /* glsl */ `
uniform int mode;
uniform float size;      // of a point of 1 m at 1 m, px
uniform float smallest;  // px
uniform vec2 heights;    // lowest and highest of the scale, m
in vec4 colour;          // red, green, blue, quality
in vec4 extra;           // intensity, moving, sigma, code of the exposure
out vec3 shown;

// From blue by green to red, rising in lightness at both ends enough to be told apart in sun.
vec3 scale(float t) {
  t = clamp(t, 0.0, 1.0);
  vec3 a = mix(vec3(0.15, 0.20, 0.70), vec3(0.05, 0.62, 0.80), smoothstep(0.0, 0.33, t));
  a = mix(a, vec3(0.35, 0.80, 0.25), smoothstep(0.33, 0.55, t));
  a = mix(a, vec3(0.98, 0.80, 0.15), smoothstep(0.55, 0.78, t));
  return mix(a, vec3(0.90, 0.15, 0.12), smoothstep(0.78, 1.0, t));
}
vec3 hue(float h) {
  return clamp(abs(mod(h * 6.0 + vec3(0.0, 4.0, 2.0), 6.0) - 3.0) - 1.0, 0.0, 1.0) * 0.75 + 0.2;
}

void main() {
  float grey = 0.25 + 0.55 * extra.x;
  bool coloured = colour.w > 0.0;
  if (mode == 0) shown = coloured ? colour.rgb : vec3(grey * 0.8);
  else if (mode == 1) shown = scale(extra.x);
  else if (mode == 2) shown = scale((position.z - heights.x) / max(heights.y - heights.x, 0.1));
  else if (mode == 3) shown = coloured ? scale(1.0 - colour.w) : vec3(0.35);
  else if (mode == 4) shown = extra.z > 0.999 ? vec3(0.35) : scale(sqrt(extra.z));
  else if (mode == 5) shown = extra.w == 0.0 ? vec3(0.35) : hue(fract(extra.w * 255.0 * 0.381966));
  else shown = extra.y >= 0.5 ? vec3(1.0, 0.25, 0.15) : vec3(grey * 0.7);
  vec4 seen = modelViewMatrix * vec4(position, 1.0);
  gl_Position = projectionMatrix * seen;
  gl_PointSize = clamp(size / max(-seen.z, 0.1), smallest, 12.0);
}
`;

export const fragmentShader = /* glsl */ `
in vec3 shown;
out vec4 fragment;
void main() {
  fragment = vec4(shown, 1.0);
}
`;
