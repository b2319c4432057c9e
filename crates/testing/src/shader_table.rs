//! Generates the table of a folder of SPIR-V: naga reads and validates every module, and what the host must know of it is
//! written as Rust.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use naga::{AddressSpace, Module, ShaderStage, StructMember, TypeInner, front::spv, valid};

/// Size and member offsets of a struct that the host fills in.
#[derive(PartialEq, Eq)]
struct Layout {
    size: u32,
    members: Vec<(String, u32)>,
}

/// Structs of all shaders by name. Structs of one name must agree.
type Layouts = BTreeMap<String, Layout>;

/// Holds `table.rs` in a package's folder of shaders to the SPIR-V beside it, or writes it where `SABAKI_WRITE_SPIRV` is 1.
pub fn is_current(shaders: &Path) {
    let text = table(&shaders.join("spirv")).expect("valid SPIR-V");
    let path = shaders.join("table.rs");
    if std::env::var_os("SABAKI_WRITE_SPIRV").is_some_and(|value| value == "1") {
        fs::write(&path, &text).expect("write");
    }
    let committed = fs::read_to_string(&path).expect("a table");
    assert!(
        committed == text,
        "{} is stale: run with SABAKI_WRITE_SPIRV=1",
        path.display()
    );
}

/// In the names of shaders that read a texel buffer in place of a storage buffer. naga reads no texel buffers: what the table says of such a
/// shader is read from the one without the word, which is of the same source, and its SPIR-V is validated where a device is made to run it.
const TEXELS: &str = "_texels";

/// The text of the table of a folder of SPIR-V.
pub fn table(spirv: &Path) -> Result<String, String> {
    let mut text = String::from(
        "// Generated from the SPIR-V beside it: SABAKI_WRITE_SPIRV=1 cargo test shader_table\n\n\
         use super::{Binding, Shader, Stage, words};\n",
    );
    let mut layouts = Layouts::new();
    for file in modules(spirv)? {
        let name = file.file_stem().and_then(|stem| stem.to_str());
        let name = name.ok_or_else(|| format!("{}: the name is not UTF-8", file.display()))?;
        let named = |message: String| format!("{name}: {message}");
        let bytes = |name: &str| {
            let path = spirv.join(format!("{name}.spv"));
            fs::read(path).map_err(|error| named(error.to_string()))
        };
        let readable = name.replace(TEXELS, "");
        let module = read(&bytes(&readable)?).map_err(named)?;
        let shader = ShaderFile {
            name,
            words: bytes(name)?.len() / 4,
            module: &module,
            texel_buffers: u32::from(readable != name),
        };
        shader.write(&mut text, &mut layouts).map_err(named)?;
    }
    structs(&mut text, &layouts);
    Ok(text)
}

/// The SPIR-V files of a folder, sorted.
fn modules(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.extension().is_some_and(|ending| ending == "spv"))
        .collect();
    files.sort();
    Ok(files)
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

/// A file of SPIR-V.
struct ShaderFile<'a> {
    name: &'a str,
    words: usize,
    module: &'a Module,
    /// How many of the module's storage buffers are texel buffers in this file.
    texel_buffers: u32,
}

impl ShaderFile<'_> {
    /// Writes one constant of type `Shader`.
    fn write(&self, text: &mut String, layouts: &mut Layouts) -> Result<(), String> {
        let Self {
            name,
            words,
            module,
            texel_buffers,
        } = *self;
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
            let size = module.types[variable.ty].inner.size(module.to_ctx());
            let stride = match variable.space {
                AddressSpace::Private | AddressSpace::Function => continue,
                AddressSpace::WorkGroup => {
                    shared += size;
                    continue;
                }
                AddressSpace::Immediate => {
                    push_constants = size;
                    note(module, variable.ty, layouts)?;
                    continue;
                }
                AddressSpace::Storage { .. } => {
                    storage_buffers += 1;
                    element(module, variable.ty, layouts)?
                }
                AddressSpace::Uniform => element(module, variable.ty, layouts)?,
                AddressSpace::Handle => 0,
                other => return Err(format!("variables in {other:?} are not used here")),
            };
            let at = variable.binding.ok_or("a buffer or image has no binding")?;
            let _ = writeln!(
                bindings,
                "        Binding {{ set: {}, binding: {}, stride: {stride} }},",
                at.group, at.binding
            );
        }
        storage_buffers -= texel_buffers;
        let bindings = match bindings.is_empty() {
            true => "&[]".to_owned(),
            false => format!("&[\n{bindings}    ]"),
        };
        let _ = writeln!(
            text,
            "\npub(crate) const {}: Shader = Shader {{\n    name: {name:?},\n    stage: Stage::{stage},\n    \
         push_constants: {push_constants},\n    shared: {shared},\n    group: {:?},\n    \
         storage_buffers: {storage_buffers},\n    bindings: {bindings},\n    \
         words: &words::<{words}>(include_bytes!(\"spirv/{name}.spv\")),\n}};",
            name.replace('.', "_").to_uppercase(),
            point.workgroup_size,
        );
        Ok(())
    }
}

/// Stride of the array that a buffer consists of. Keeps the layout of its elements.
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

/// Keeps the layout of a struct.
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

/// Writes one module of constants for each struct.
fn structs(text: &mut String, layouts: &Layouts) {
    for (name, layout) in layouts {
        let _ = writeln!(text, "\n#[allow(non_snake_case)]\npub(crate) mod {name} {{");
        let _ = writeln!(text, "    pub(crate) const SIZE: usize = {};", layout.size);
        for (member, offset) in &layout.members {
            let member = member.to_uppercase();
            let _ = writeln!(text, "    pub(crate) const {member}: usize = {offset};");
        }
        text.push_str("}\n");
    }
}
