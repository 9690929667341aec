// Prints what the Khronos validator says of each .glb that is named, one JSON object a line.
const fs = require("fs");
const validator = require("gltf-validator");

async function main() {
  for (const file of process.argv.slice(2)) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {maxIssues: 20});
    console.log(JSON.stringify({file, ...report.issues, info: report.info}));
  }
}

main().catch((error) => { console.error(String(error)); process.exit(1); });
