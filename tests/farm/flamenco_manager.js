// A minimal Flamenco Manager: compiles a job with a job type script and prints its tasks as JSON.
// Provides what Flamenco documents for job compiler scripts: author, path, frameChunker, formatTimestampLocal, print, alert.
//   node flamenco_manager.js SCRIPT.js < job.json
const fs = require("fs");
const vm = require("vm");

class Task {
    constructor(name, type) {
        if (typeof name !== "string" || typeof type !== "string") throw new Error("Task(name, type)");
        this.name = name;
        this.type = type;
        this.commands = [];
        this.dependencies = [];
    }
    addCommand(command) { this.commands.push(command); }
    addDependency(task) {
        if (!(task instanceof Task)) throw new Error("addDependency(task)");
        this.dependencies.push(task);
    }
}

function Command(name, parameters) { return { name, parameters }; }

// "1-3, 7" in chunks of 2 is ["1-2", "3,7"]
function frameChunker(text, size) {
    const frames = [];
    for (const part of text.split(",")) {
        const [first, last] = part.trim().split("-").map(Number);
        for (let frame = first; frame <= (last === undefined ? first : last); frame++) frames.push(frame);
    }
    const chunks = [];
    for (let start = 0; start < frames.length; start += size) {
        const runs = [];
        for (const frame of frames.slice(start, start + size)) {
            const run = runs[runs.length - 1];
            if (run && run[1] === frame - 1) run[1] = frame; else runs.push([frame, frame]);
        }
        chunks.push(runs.map(([a, b]) => (a === b ? `${a}` : `${a}-${b}`)).join(","));
    }
    return chunks;
}

// Flamenco's own paths take both kinds of slashes, whatever the system.
const crosspath = {
    basename: file => file.split(/[\\/]/).pop(),
    dirname: file => file.slice(0, Math.max(file.lastIndexOf("/"), file.lastIndexOf("\\"), 0)) || ".",
    join: (...parts) => parts.join("/").replace(/\/+/g, "/"),
    stem: file => crosspath.basename(file).replace(/\.[^.]*$/, "")
};

const context = vm.createContext({
    author: {
        Task: function (name, type) { return new Task(name, type); },
        Command: function (name, parameters) { return Command(name, parameters); }
    },
    path: crosspath,
    frameChunker,
    formatTimestampLocal: timestamp => timestamp.toISOString(),
    print: () => undefined,
    alert: () => undefined
});
vm.runInContext(fs.readFileSync(process.argv[2], "utf8"), context);

const jobType = vm.runInContext("JOB_TYPE", context);
const given = JSON.parse(fs.readFileSync(0, "utf8"));
const settings = {};
for (const setting of jobType.settings) {
    if (setting.key in given) settings[setting.key] = given[setting.key];
    else if (setting.required) throw new Error(`setting '${setting.key}' is required`);
    else settings[setting.key] = setting.default;
}
const tasks = [];
context.job = { settings, name: "job", created: new Date(0), addTask: task => tasks.push(task) };
vm.runInContext("compileJob(job)", context);
if (!tasks.every(task => task.dependencies.every(other => tasks.includes(other)))) {
    throw new Error("a task depends on one that is not in the job");
}
console.log(JSON.stringify({
    settings: jobType.settings,
    tasks: tasks.map(task => ({ ...task, dependencies: task.dependencies.map(other => other.name) }))
}));
