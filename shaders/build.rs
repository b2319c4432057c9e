//! Reads the committed SPIR-V with naga: validates it, and writes the table that `src/gpu/shader_table.rs` includes.
//!
//! Only with the feature `vulkan`; without it there is nothing to do.

#[cfg(not(feature = "vulkan"))]
fn main() {
    println!("cargo::rerun-if-changed=shaders/build.rs");
}

#[cfg(feature = "vulkan")]
fn main() -> std::process::ExitCode {
    match table::write() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(message) => {
            println!("cargo::error={}", message.replace('\n', " "));
            std::process::ExitCode::FAILURE
        }
    }
}

#[cfg(feature = "vulkan")]
mod table {
    use std::{
        collections::BTreeMap,
        env,
        fmt::Write as _,
        fs,
        path::{Path, PathBuf},
    };

    use naga::{AddressSpace, Module, ShaderStage, StructMember, TypeInner, front::spv, valid};

    /// Size and member offsets of a struct that the host fills in.
    #[derive(PartialEq, Eq)]
    struct Layout {
        size: u32,
        members: Vec<(String, u32)>,
    }

    /// By name: the structs of all shaders, which must agree.
    type Layouts = BTreeMap<String, Layout>;

    pub(super) fn write() -> Result<(), String> {
        let folder = PathBuf::from("shaders/spirv");
        println!("cargo::rerun-if-changed=shaders/build.rs");
        println!("cargo::rerun-if-changed={}", folder.display());
        let mut files: Vec<PathBuf> = fs::read_dir(&folder)
            .map_err(|error| format!("{}: {error}", folder.display()))?
            .filter_map(|entry| entry.ok().map(|entry| entry.path()))
            .filter(|path| path.extension().is_some_and(|ending| ending == "spv"))
            .collect();
        files.sort();

        write_table(&files, "shader_table.rs")
    }

    fn write_table(files: &[PathBuf], table: &str) -> Result<(), String> {
        let mut text = String::from("// Written by shaders/build.rs.\n");
        let mut layouts = Layouts::new();
        for file in files {
            println!("cargo::rerun-if-changed={}", file.display());
            let of_file = |message: String| format!("{}: {message}", file.display());
            let bytes = fs::read(file).map_err(|error| of_file(error.to_string()))?;
            let module = read(&bytes).map_err(of_file)?;
            let name = file
                .file_stem()
                .and_then(|stem| stem.to_str())
                .ok_or_else(|| of_file("its name is not text".to_owned()))?;
            entry(&mut text, name, &bytes, &module, &mut layouts).map_err(of_file)?;
        }
        structs(&mut text, &layouts);
        let out = env::var_os("OUT_DIR").ok_or("OUT_DIR is not set")?;
        fs::write(Path::new(&out).join(table), text).map_err(|error| error.to_string())
    }

    fn read(bytes: &[u8]) -> Result<Module, String> {
        let options = spv::Options {
            adjust_coordinate_space: false,
            ..spv::Options::default()
        };
        let module = spv::parse_u8_slice(bytes, &options).map_err(|error| error.to_string())?;
        let capabilities = valid::Capabilities::IMMEDIATES | valid::Capabilities::EARLY_DEPTH_TEST;
        valid::Validator::new(valid::ValidationFlags::all(), capabilities)
            .validate(&module)
            .map_err(|error| format!("{:?}", error.into_inner()))?;
        Ok(module)
    }

    /// One constant of type `Shader`.
    fn entry(
        text: &mut String,
        name: &str,
        bytes: &[u8],
        module: &Module,
        layouts: &mut Layouts,
    ) -> Result<(), String> {
        let [point] = module.entry_points.as_slice() else {
            return Err("it does not have one entry point".to_owned());
        };
        let stage = match point.stage {
            ShaderStage::Vertex => "Vertex",
            ShaderStage::Fragment => "Fragment",
            ShaderStage::Compute => "Compute",
            other => return Err(format!("stage {other:?} is not used here")),
        };
        if point.name != "main" {
            return Err(format!("its entry point is {:?}, not main", point.name));
        }
        let (mut bindings, mut push_constants, mut shared) = (String::new(), 0, 0);
        let mut storage_buffers = 0;
        for (_, variable) in module.global_variables.iter() {
            if matches!(variable.space, AddressSpace::Storage { .. }) {
                storage_buffers += 1;
            }
            let size = module.types[variable.ty].inner.size(module.to_ctx());
            match variable.space {
                AddressSpace::Immediate => {
                    push_constants = size;
                    note(module, variable.ty, layouts)?;
                }
                AddressSpace::Storage { .. } | AddressSpace::Uniform => {
                    let at = variable.binding.ok_or("a buffer has no binding")?;
                    let stride = element(module, variable.ty, layouts)?;
                    let _ = write!(
                        bindings,
                        "Binding {{ set: {}, binding: {}, stride: {stride} }}, ",
                        at.group, at.binding
                    );
                }
                AddressSpace::WorkGroup => shared += size,
                AddressSpace::Handle => {
                    let at = variable.binding.ok_or("an image has no binding")?;
                    let _ = write!(
                        bindings,
                        "Binding {{ set: {}, binding: {}, stride: 0 }}, ",
                        at.group, at.binding
                    );
                }
                AddressSpace::Private | AddressSpace::Function => {}
                other => return Err(format!("variables in {other:?} are not used here")),
            }
        }
        let words: Vec<String> = bytes
            .chunks_exact(4)
            .map(|word| {
                format!(
                    "{:#010x}",
                    u32::from_le_bytes([word[0], word[1], word[2], word[3]])
                )
            })
            .collect();
        let _ = writeln!(
            text,
            "pub(crate) const {}: Shader = Shader {{ name: {name:?}, stage: Stage::{stage}, push_constants: \
             {push_constants}, shared: {shared}, storage_buffers: {storage_buffers}, group: {:?}, bindings: &[{bindings}], words: &[{}] }};",
            name.replace('.', "_").to_uppercase(),
            point.workgroup_size,
            words.join(", "),
        );
        Ok(())
    }

    /// Stride of the array that a buffer consists of; keeps the layout of its elements.
    fn element(
        module: &Module,
        block: naga::Handle<naga::Type>,
        layouts: &mut Layouts,
    ) -> Result<u32, String> {
        let TypeInner::Struct { members, .. } = &module.types[block].inner else {
            return Err("a buffer is not a block".to_owned());
        };
        let [StructMember { ty, .. }] = members.as_slice() else {
            return Err("a buffer holds more than one array".to_owned());
        };
        let TypeInner::Array { base, stride, .. } = module.types[*ty].inner else {
            return Err("a buffer does not hold an array".to_owned());
        };
        if matches!(module.types[base].inner, TypeInner::Struct { .. }) {
            note(module, base, layouts)?;
        }
        Ok(stride)
    }

    /// Keeps the layout of a struct; another shader's struct of the same name must be the same.
    fn note(
        module: &Module,
        ty: naga::Handle<naga::Type>,
        layouts: &mut Layouts,
    ) -> Result<(), String> {
        let ty = &module.types[ty];
        let TypeInner::Struct { members, span } = &ty.inner else {
            return Err("a block is not a struct".to_owned());
        };
        let name = ty.name.clone().ok_or("a struct has no name")?;
        let member = |member: &StructMember| {
            let name = member.name.clone().ok_or("a member has no name")?;
            Ok::<_, String>((name, member.offset))
        };
        let layout = Layout {
            size: *span,
            members: members.iter().map(member).collect::<Result<_, _>>()?,
        };
        match layouts.get(&name) {
            Some(known) if *known != layout => {
                Err(format!("its {name} differs from that of an earlier shader"))
            }
            _ => {
                layouts.insert(name, layout);
                Ok(())
            }
        }
    }

    /// One module of constants for each struct.
    fn structs(text: &mut String, layouts: &Layouts) {
        for (name, layout) in layouts {
            let _ = writeln!(text, "#[allow(non_snake_case)] pub(crate) mod {name} {{");
            let _ = writeln!(text, "    pub(crate) const SIZE: usize = {};", layout.size);
            for (member, offset) in &layout.members {
                let member = member.to_uppercase();
                let _ = writeln!(text, "    pub(crate) const {member}: usize = {offset};");
            }
            text.push_str("}\n");
        }
    }
}
