//! The committed SPIR-V is what the GLSL beside it compiles to.
//!
//! `SABAKI_WRITE_SPIRV=1 cargo test --package sabaki-shaders --features shaderc` writes it.
#![allow(clippy::unwrap_used, clippy::expect_used)]

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

/// The folders with shaders: of the component, and of the package that draws.
fn folders() -> [PathBuf; 2] {
    // Asked at run time: a build folder may be shared by several checkouts.
    let package = std::env::var_os("CARGO_MANIFEST_DIR").expect("a test that Cargo runs");
    let packages = Path::new(&package).join("..");
    [packages.join("../shaders"), packages.join("draw/shaders")]
}

fn names(folder: &Path, ending: &str) -> BTreeSet<String> {
    fs::read_dir(folder)
        .unwrap()
        .filter_map(|entry| {
            let name = entry.unwrap().file_name().into_string().unwrap();
            name.strip_suffix(ending).map(str::to_owned)
        })
        .collect()
}

fn compile(compiler: &shaderc::Compiler, folder: &Path, name: &str) -> Vec<u8> {
    let mut options = shaderc::CompileOptions::new().expect("options");
    // Unoptimised: the words stay readable, their names stay for the table, and every driver
    // optimises again.
    options.set_optimization_level(shaderc::OptimizationLevel::Zero);
    options.set_target_env(
        shaderc::TargetEnv::Vulkan,
        shaderc::EnvVersion::Vulkan1_3 as u32,
    );
    options.set_target_spirv(shaderc::SpirvVersion::V1_3);
    options.set_warnings_as_errors();
    let include = folder.join("include");
    options.set_include_callback(move |wanted, _, _, _| {
        let path = include.join(wanted);
        let content = fs::read_to_string(&path).map_err(|error| error.to_string())?;
        Ok(shaderc::ResolvedInclude {
            resolved_name: wanted.to_owned(),
            content,
        })
    });
    let kind = match name.rsplit('.').next() {
        Some("vert") => shaderc::ShaderKind::Vertex,
        Some("frag") => shaderc::ShaderKind::Fragment,
        Some("comp") => shaderc::ShaderKind::Compute,
        _ => panic!("{name}: its stage is not known"),
    };
    let file = format!("{name}.glsl");
    let source = fs::read_to_string(folder.join(&file)).expect("source");
    let artifact = compiler
        .compile_into_spirv(&source, kind, &file, "main", Some(&options))
        .unwrap_or_else(|error| panic!("{error}"));
    without_workgroup_size(artifact.as_binary())
}

/// Bytes of a module without the decoration `BuiltIn WorkgroupSize`, which the compiler gives every
/// compute shader, used or not, and which validation warns of. The execution mode `LocalSize` says
/// the same.
fn without_workgroup_size(module: &[u32]) -> Vec<u8> {
    const HEADER_WORDS: usize = 5;
    const OP_DECORATE: u32 = 71;
    const BUILT_IN: u32 = 11;
    const WORKGROUP_SIZE: u32 = 25;
    let (header, mut rest) = module.split_at(HEADER_WORDS);
    let mut words = header.to_vec();
    while let Some(&first) = rest.first() {
        let (instruction, after) = rest.split_at((first >> 16) as usize);
        let decorates = first & 0xffff == OP_DECORATE;
        if !(decorates && instruction[2..] == [BUILT_IN, WORKGROUP_SIZE]) {
            words.extend(instruction);
        }
        rest = after;
    }
    words.into_iter().flat_map(u32::to_le_bytes).collect()
}

#[test]
fn committed_words_are_those_of_the_sources() {
    let compiler = shaderc::Compiler::new().expect("compiler");
    let write = std::env::var_os("SABAKI_WRITE_SPIRV").is_some_and(|value| value == "1");
    for folder in folders() {
        let spirv = folder.join("spirv");
        let sources = names(&folder, ".glsl");
        assert!(sources.len() > 5, "{}", folder.display());
        for name in &sources {
            let words = compile(&compiler, &folder, name);
            let path = spirv.join(format!("{name}.spv"));
            if write {
                fs::write(&path, &words).expect("write");
            }
            let committed = fs::read(&path).unwrap_or_else(|error| panic!("{name}.spv: {error}"));
            assert!(
                committed == words,
                "{name}.spv is stale: run with SABAKI_WRITE_SPIRV=1"
            );
        }
        assert_eq!(
            names(&spirv, ".spv"),
            sources,
            "every committed file has a source"
        );
    }
}
