// Makes three.min.js and three.LICENSE, which are committed: node bundle.mjs, where npm is.
// The versions are stated here, so that the same script gives the same files.
import { execSync } from "node:child_process";
import { copyFileSync, mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const THREE = "0.187.0", ESBUILD = "0.28.2";
const USED = [
  "AlwaysStencilFunc", "AmbientLight", "BackSide", "Box3", "BufferAttribute", "BufferGeometry",
  "Color", "ColorManagement", "ConeGeometry", "CylinderGeometry", "Data3DTexture", "DecrementWrapStencilOp",
  "DirectionalLight", "DoubleSide", "FrontSide", "Group", "HemisphereLight",
  "IncrementWrapStencilOp", "LinearFilter", "LineBasicMaterial", "LineDashedMaterial",
  "LineSegments", "Mesh", "MeshBasicMaterial", "MeshLambertMaterial", "NearestFilter",
  "NotEqualStencilFunc", "OrthographicCamera", "Plane", "PlaneGeometry", "Quaternion",
  "RGBAFormat", "Raycaster", "ReplaceStencilOp", "Scene", "Vector2", "Vector3", "WebGLRenderer",
];

const here = dirname(fileURLToPath(import.meta.url));
const work = mkdtempSync(join(tmpdir(), "three-"));
const run = (command) => execSync(command, { cwd: work, stdio: "inherit" });
writeFileSync(join(work, "package.json"), "{}");
run(`npm install --silent three@${THREE} esbuild@${ESBUILD}`);
writeFileSync(
  join(work, "entry.js"),
  `export { ${USED.join(", ")} } from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";\n`,
);
run(
  "npx esbuild entry.js --bundle --minify --format=iife --global-name=THREE --target=es2022 " +
    `--charset=utf8 --legal-comments=none --banner:js="/* three.js ${THREE}, MIT licence, see three.LICENSE */" ` +
    `--outfile=${join(here, "three.min.js")}`,
);
copyFileSync(join(work, "node_modules/three/LICENSE"), join(here, "three.LICENSE"));
