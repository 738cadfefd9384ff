// Runs the Khronos glTF validator on .gltf and .glb files and on folders; prints one line per error and warning.
"use strict";
const fs = require("fs");
const path = require("path");
const validator = require("gltf-validator");

// Ignored warnings, which are the subject of some tests: unknown extensions, tangents that a reader must generate, and
// the transform of a node with a skin.
const ignored = [
    "UNSUPPORTED_EXTENSION", "MESH_PRIMITIVE_GENERATED_TANGENT_SPACE", "NODE_SKINNED_MESH_LOCAL_TRANSFORMS",
];

function filesIn(name) {
    if (!fs.statSync(name).isDirectory()) return [name];
    const entries = fs.readdirSync(name).sort().map((entry) => path.join(name, entry));
    return entries.flatMap((entry) =>
        fs.statSync(entry).isDirectory() ? filesIn(entry) : /\.(gltf|glb)$/i.test(entry) ? [entry] : []);
}

async function main() {
    const files = process.argv.slice(2).flatMap(filesIn);
    let rejected = 0;
    for (const file of files) {
        const readSibling = (uri) => fs.promises.readFile(path.join(path.dirname(file), decodeURIComponent(uri)));
        const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
            uri: file,
            maxIssues: 100,
            externalResourceFunction: async (uri) => new Uint8Array(await readSibling(uri)),
        });
        const issues = report.issues.messages.filter((issue) => issue.severity < 2 && !ignored.includes(issue.code));
        for (const issue of issues) console.log(`${file}: ${issue.code} ${issue.pointer ?? ""}: ${issue.message}`);
        if (issues.length > 0) rejected += 1;
    }
    console.log(`${files.length} files, ${rejected} with errors or warnings`);
    if (rejected > 0 || files.length === 0) process.exitCode = 1;
}

main();
