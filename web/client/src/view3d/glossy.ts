// The material of parts that shine.

import { MeshStandardMaterial } from "three";
import type { Look } from "../replay/frame-state";

const GHOST_OPACITY = 0.55;

/**
 * What shiny parts reflect: a bright ceiling with two lamps over a dim floor. It is computed per pixel; an image of the
 * surroundings would have to be filtered first, which takes seconds without a graphics card.
 */
const REFLECTION = `
#include <lights_fragment_end>
{
  vec3 away = reflect(-geometryViewDir, normal);
  // From the camera's axes to those of the table.
  vec3 up = (vec4(away, 0.0) * viewMatrix).xyz;
  float ceiling = smoothstep(-0.15, 0.9, up.z);
  float lamp = smoothstep(0.16, 0.06, abs(up.x * 0.5 + up.y * 0.87 + 0.42)) * smoothstep(0.25, 0.6, up.z);
  float window = smoothstep(0.2, 0.1, abs(up.z - 0.28)) * smoothstep(0.1, 0.8, up.y);
  float grazing = pow(1.0 - clamp(dot(geometryViewDir, normal), 0.0, 1.0), 4.0);
  float share = 0.045 + 0.4 * grazing;
  reflectedLight.indirectSpecular += share * (0.5 * ceiling + 3.2 * lamp + 1.2 * window);
}`;

export function glossyMaterial(roughness: number, look: Look): MeshStandardMaterial {
  const material = new MeshStandardMaterial({ vertexColors: true, roughness, metalness: 0 });
  if (look === "ghost") {
    material.transparent = true;
    material.opacity = GHOST_OPACITY;
    // Behind what it coincides with, as at the start of two episodes.
    material.polygonOffset = true;
    material.polygonOffsetFactor = 1;
    material.polygonOffsetUnits = 4;
  }
  material.onBeforeCompile = (shader) => {
    shader.fragmentShader = shader.fragmentShader.replace("#include <lights_fragment_end>", REFLECTION);
  };
  return material;
}
