// Runs the Khronos validator over .gltf and .glb files, and over those of folders: a line for each error and warning.
"use strict";
const fs = require("fs");
const path = require("path");
const validator = require("gltf-validator");

// What it warns of and some tests are about: extensions that it does not know, tangents that a reader must make, and the place of
// a node with a skin.
const quiet = [
    "UNSUPPORTED_EXTENSION", "MESH_PRIMITIVE_GENERATED_TANGENT_SPACE", "NODE_SKINNED_MESH_LOCAL_TRANSFORMS",
];

function found(name) {
    if (!fs.statSync(name).isDirectory()) return [name];
    const inside = fs.readdirSync(name).sort().map((entry) => path.join(name, entry));
    return inside.flatMap((entry) =>
        fs.statSync(entry).isDirectory() ? found(entry) : /\.(gltf|glb)$/i.test(entry) ? [entry] : []);
}

async function main() {
    const files = process.argv.slice(2).flatMap(found);
    let bad = 0;
    for (const file of files) {
        const beside = (uri) => fs.promises.readFile(path.join(path.dirname(file), decodeURIComponent(uri)));
        const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
            uri: file,
            maxIssues: 100,
            externalResourceFunction: async (uri) => new Uint8Array(await beside(uri)),
        });
        const told = report.issues.messages.filter((issue) => issue.severity < 2 && !quiet.includes(issue.code));
        for (const issue of told) console.log(`${file}: ${issue.code} ${issue.pointer ?? ""}: ${issue.message}`);
        if (told.length > 0) bad += 1;
    }
    console.log(`${files.length} files, ${bad} with errors or warnings`);
    if (bad > 0 || files.length === 0) process.exitCode = 1;
}

main();
