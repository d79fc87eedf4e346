// The material of bodies and ground: a standard one with the solid checker pattern that shows how a body turns.

import { Color, DoubleSide, FrontSide, MeshBasicMaterial, MeshStandardMaterial, Vector3 } from "three";

export function makeMaterial(mesh, { transparent, unlit, ground }) {
  const options = {
    color: new Color(1, 1, 1),
    vertexColors: mesh.colors !== null,
    side: mesh.twoSided ? DoubleSide : FrontSide,
    transparent,
    depthWrite: !transparent,
  };
  const material = unlit
    ? new MeshBasicMaterial({ ...options, fog: false })
    : new MeshStandardMaterial({ ...options, roughness: ground ? 0.95 : 0.5, metalness: 0 });
  const inverse = new Vector3(...mesh.cells.map((cell) => (cell > 0 ? 1 / cell : 0)));
  material.onBeforeCompile = (shader) => {
    shader.uniforms.cellInverse = { value: inverse };
    shader.uniforms.contrast = { value: mesh.contrast };
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying vec3 vBodyPoint;\nattribute float opacity;\nvarying float vOpacity;")
      .replace("#include <begin_vertex>", "#include <begin_vertex>\nvBodyPoint = position;\nvOpacity = opacity;");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", `#include <common>
        varying vec3 vBodyPoint;
        varying float vOpacity;
        uniform vec3 cellInverse;
        uniform float contrast;`)
      .replace("#include <color_fragment>", `#include <color_fragment>
        vec3 cell = floor(vBodyPoint * cellInverse + 1e-4);
        float odd = mod(cell.x + cell.y + cell.z, 2.0);
        diffuseColor.rgb *= 1.0 + contrast * (1.0 - 2.0 * odd);
        diffuseColor.a *= vOpacity;`);
  };
  return material;
}
