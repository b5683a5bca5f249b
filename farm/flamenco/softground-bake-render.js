// SoftGround job type for Flamenco: bakes the footprints of each shot in one task, and renders the baked shot in
// tasks that depend on it. Copy this file to the folder `scripts` beside the Flamenco Manager and restart it.
// The workers' Blender needs the SoftGround extension.

const JOB_TYPE = {
    label: "SoftGround Bake and Render",
    description: "Bake footprints into the ground, then render",
    settings: [
        {
            key: "preset", type: "string", required: false, default: "",
            description: "Ground preset, by name; empty for what each shot has"
        },
        {
            key: "further_shots", type: "string", required: false, default: "",
            description: "More .blend files to bake and render in the same way, separated by semicolons"
        },
        { key: "render", type: "bool", required: false, default: true, description: "Render the baked shots" },
        {
            key: "frames", type: "string", required: true,
            eval: "f'{C.scene.frame_start}-{C.scene.frame_end}'",
            evalInfo: { showLinkButton: true, description: "Scene frame range" },
            description: "Frames to render. Examples: '47', '1-30', '3, 5-10, 47-327'"
        },
        {
            key: "chunk_size", type: "int32", required: false, default: 10, propargs: { min: 1 },
            description: "Frames that a task renders", visible: "submission"
        },
        {
            key: "render_output_root", type: "string", subtype: "dir_path", required: true, visible: "submission",
            description: "Folder of the pictures; each shot gets a folder of its own in it"
        },
        { key: "blendfile", type: "string", required: true, visible: "web", description: "Path of the shot" },
        {
            key: "format", type: "string", required: true, eval: "C.scene.render.image_settings.file_format",
            visible: "web"
        }
    ]
};

function compileJob(job) {
    const settings = job.settings;
    const shots = [settings.blendfile].concat(list(settings.further_shots));
    const stems = shots.map(shot => path.stem(shot));
    shots.forEach((shot, index) => {
        const earlier = stems.slice(0, index).filter(stem => stem === stems[index]).length;
        const name = earlier > 0 ? `${stems[index]}-${earlier + 1}` : stems[index];
        const bake = authorBake(settings, shot, name);
        job.addTask(bake);
        if (!settings.render) return;
        for (const task of authorRenders(settings, shot, name)) {
            task.addDependency(bake);
            job.addTask(task);
        }
    });
}

function authorBake(settings, shot, name) {
    const options = [`--save=${bakedPath(shot)}`, "--progress=plain"];
    if (settings.preset) options.push(`--preset=${settings.preset}`);
    const task = author.Task(`bake-${name}`, "blender");
    task.addCommand(blender(shot, ["--command", "softground", "bake"].concat(options)));
    return task;
}

function authorRenders(settings, shot, name) {
    const output = path.join(settings.render_output_root, name, "######");
    return frameChunker(settings.frames, settings.chunk_size).map(chunk => {
        const task = author.Task(`render-${name}-${chunk}`, "blender");
        task.addCommand(blender(bakedPath(shot), [
            "--render-output", output,
            "--render-format", settings.format,
            "--render-frame", chunk.replaceAll("-", "..") // Blender's notation of a range
        ]));
        return task;
    });
}

// The baked shot lies beside the shot, so that relative paths in it stay right.
function bakedPath(shot) {
    return path.join(path.dirname(shot), `${path.stem(shot)}-baked.blend`);
}

function blender(blendfile, args) {
    return author.Command("blender-render", {
        exe: "{blender}",
        exeArgs: "{blenderArgs}",
        argsBefore: [],
        blendfile: blendfile,
        args: args
    });
}

function list(text) {
    return (text || "").split(";").map(item => item.trim()).filter(item => item.length > 0);
}
