//! Every unsafe call of the room: MuJoCo's log handler, its table of collision functions, its GL context, EGL.
// Long because: unsafe code of the room is in one file.

use std::{
    ffi::{CStr, c_char, c_int, c_void},
    io::Write,
    slice,
    sync::{Once, OnceLock},
};

use khronos_egl as egl;
use mujoco_rs::{
    error::MjEditError,
    logging::set_log_handler,
    mujoco_c::{mjCOLLISIONFUNC, mjData, mjModel, mjPreContact, mjfCollision, mjtDepthMap},
    wrappers::{
        mj_data::MjData,
        mj_editing::{MjSpec, MjsGeom, SpecObject},
        mj_logging::{MjLogMessage, MjtLogLevel},
        mj_model::{MjModel, MjtGeomBase, MjtJoint, MjtObjBase},
        mj_rendering::{MjrContext, MjtFramebuffer},
        mj_visualization::MjvScene,
    },
};

use crate::{
    convert::placement,
    error::GlError,
    objects::{
        collider::with_scene,
        free_object::{FreeObject, Touched},
        patch::BodyPatch,
        table::Table,
        true_mesh::{WorldContact, with_collider},
    },
};

use nalgebra::IsometryMatrix3;

type Egl = egl::DynamicInstance<egl::EGL1_4>;

/// Must come before any other call into MuJoCo: every public function of the room that makes the first object
/// calls it. Keeps MuJoCo from writing `MUJOCO_LOG.TXT` into the working folder, and puts our functions for true meshes and
/// for the bodies of scenes into its table.
pub(super) fn prepare_library() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // SAFETY: no thread is past this `Once` yet, and nothing outside the room calls MuJoCo.
        #[expect(unsafe_code, reason = "MuJoCo keeps its log handler in a plain global")]
        unsafe {
            set_log_handler(report_fatal);
        }
        let mut own = [None; SOLIDS.len()];
        for (own, solid) in own.iter_mut().zip(SOLIDS) {
            // SAFETY: as above; our function does the same as the old one for threads that lend no collider.
            #[expect(unsafe_code, reason = "MuJoCo keeps its collision functions in a plain global")]
            unsafe {
                let entry = &raw mut mjCOLLISIONFUNC[solid as usize][MjtGeomBase::mjGEOM_MESH as usize];
                *own = entry.read();
                entry.write(Some(collide_with_mesh));
            }
        }
        // Inside the `Once` no other code has set it.
        let _ = OWN_COLLISIONS.set(own);
        // SAFETY: as above.
        #[expect(unsafe_code, reason = "MuJoCo keeps its collision functions in a plain global")]
        unsafe {
            let boxes = MjtGeomBase::mjGEOM_BOX as usize;
            let entry = &raw mut mjCOLLISIONFUNC[boxes][boxes];
            let _ = OWN_BOXES.set(entry.read());
            entry.write(Some(collide_boxes));
        }
    });
}

/// Removes the free joints of bodies in the world from a description, so that they are fixed. Keyframes would have
/// another length; they are moved to the joints' own values.
pub(super) fn drop_free_joints(spec: &mut MjSpec) -> Result<(), MjEditError> {
    let mut dropped = false;
    for body in spec.world_body_mut().body_iter_mut() {
        if let Some(joint) = body.joint_iter_mut(false).find(|joint| joint.type_() == MjtJoint::mjJNT_FREE) {
            dropped = true;
            // SAFETY: the walk has just found it, it is deleted once, and no handle to it outlives this.
            #[expect(unsafe_code, reason = "MuJoCo frees what it deletes")]
            unsafe {
                joint.delete()?;
            }
        }
    }
    if dropped {
        for key in spec.key_iter_mut() {
            key.set_qpos(&[]);
            key.set_qvel(&[]);
        }
    }
    Ok(())
}

/// Lets MuJoCo size its memory by a model's content, not by the description's request: too little would drop contacts
/// silently, too much would end the process.
pub(super) fn size_memory_by_content(spec: &mut MjSpec) {
    spec.set_memory(-1);
    spec.set_nuserdata(0);
    spec.set_nkey(0);
    // SAFETY: these are counts that MuJoCo reads when it compiles; -1 is its own default for each.
    #[expect(unsafe_code, reason = "the counts have no safe setter")]
    unsafe {
        let sizes = spec.ffi_mut();
        (sizes.njmax, sizes.nconmax, sizes.nstack) = (-1, -1, -1);
        (sizes.nuser_body, sizes.nuser_jnt, sizes.nuser_geom, sizes.nuser_site) = (-1, -1, -1, -1);
        (sizes.nuser_cam, sizes.nuser_tendon, sizes.nuser_actuator, sizes.nuser_sensor) = (-1, -1, -1, -1);
    }
}

/// MuJoCo's own list of the elements and attributes of MJCF.
#[cfg(test)]
pub(super) fn schema() -> String {
    let mut buffer = vec![0u8; 1 << 20];
    // SAFETY: MuJoCo writes no more than the buffer's length, a terminating null included.
    #[expect(unsafe_code, reason = "a C string")]
    let written = unsafe {
        mujoco_rs::mujoco_c::mj_printSchema(std::ptr::null(), buffer.as_mut_ptr().cast(), buffer.len() as c_int, 0, 0)
    };
    buffer.truncate(usize::try_from(written).expect("a length"));
    String::from_utf8(buffer).expect("ASCII")
}

/// Removes all meshes from a description that was compiled to this model, whose bodies keep their masses; `false` if a
/// body without a name cannot be reached.
pub(super) fn drop_meshes(spec: &mut MjSpec, model: &MjModel) -> Result<bool, MjEditError> {
    for body in 1..model.body_mass().len() {
        let name = model.id_to_name(MjtObjBase::mjOBJ_BODY, body).filter(|name| !name.is_empty());
        let Some(written) = name.and_then(|name| spec.body_mut(name)) else { return Ok(false) };
        written.set_mass(model.body_mass()[body]);
        *written.ipos_mut() = model.body_ipos()[body];
        *written.iquat_mut() = model.body_iquat()[body];
        *written.inertia_mut() = model.body_inertia()[body];
        *written.fullinertia_mut() = [f64::NAN; 6];
        written.set_explicitinertial(true);
    }
    let is_mesh = |geom: &&mut MjsGeom| geom.type_() == MjtGeomBase::mjGEOM_MESH;
    while let Some(geom) = spec.geom_iter_mut().find(is_mesh) {
        // SAFETY: the walk has just found it, it is deleted once, and no handle to it outlives this.
        #[expect(unsafe_code, reason = "MuJoCo frees what it deletes")]
        unsafe {
            geom.delete()?;
        }
    }
    while let Some(mesh) = spec.mesh_iter_mut().next() {
        // SAFETY: as above.
        #[expect(unsafe_code, reason = "MuJoCo frees what it deletes")]
        unsafe {
            mesh.delete()?;
        }
    }
    Ok(true)
}

/// The geoms that a true mesh is compared with, before a mesh in MuJoCo's order.
const SOLIDS: [MjtGeomBase; 5] = [
    MjtGeomBase::mjGEOM_PLANE,
    MjtGeomBase::mjGEOM_SPHERE,
    MjtGeomBase::mjGEOM_CAPSULE,
    MjtGeomBase::mjGEOM_CYLINDER,
    MjtGeomBase::mjGEOM_BOX,
];

/// MuJoCo's own collision functions of these and a mesh.
static OWN_COLLISIONS: OnceLock<[mjfCollision; SOLIDS.len()]> = OnceLock::new();

/// A solid against a mesh: against the true one that this thread has lent, else as MuJoCo does it.
#[expect(unsafe_code, reason = "a function that MuJoCo calls")]
unsafe extern "C" fn collide_with_mesh(
    model: *const mjModel,
    data: *mut mjData,
    contacts: *mut mjPreContact,
    solid: c_int,
    mesh: c_int,
    margin: f64,
) -> c_int {
    // SAFETY: MuJoCo calls with a model, its data, numbers of its geoms, and room for as many contacts as the kind of solid may
    // have (`Probe::max_contacts`; three for a plane).
    #[expect(unsafe_code, reason = "MuJoCo's structs")]
    unsafe {
        let found = with_collider(mesh, |collider| {
            let body = *(*model).geom_bodyid.add(mesh as usize) as usize;
            let world_from_solid = pose_at((*data).geom_xpos, (*data).geom_xmat, solid as usize);
            let world_from_object = pose_at((*data).xpos, (*data).xmat, body);
            // From the solid to the mesh.
            let found = collider.contacts(solid, &world_from_solid, &world_from_object, margin);
            write_contacts(contacts, found.map(|contact| WorldContact { normal: -contact.normal, ..contact }))
        });
        found.unwrap_or_else(|| {
            let kind = (*model).geom_type.add(solid as usize).read();
            let own = SOLIDS.iter().position(|solid| *solid as i32 == kind);
            let own = own.and_then(|pose| OWN_COLLISIONS.get()?[pose]);
            own.map_or(0, |own| own(model, data, contacts, solid, mesh, margin))
        })
    }
}

/// MuJoCo's own collision function of two boxes.
static OWN_BOXES: OnceLock<mjfCollision> = OnceLock::new();

/// Two boxes: the true meshes of the scene that this thread steps, else as MuJoCo does it.
#[expect(unsafe_code, reason = "a function that MuJoCo calls")]
unsafe extern "C" fn collide_boxes(
    model: *const mjModel,
    data: *mut mjData,
    contacts: *mut mjPreContact,
    one: c_int,
    other: c_int,
    margin: f64,
) -> c_int {
    // SAFETY: MuJoCo calls with a model, its data, numbers of its geoms, and room for eight contacts, which is what a pair of
    // bodies may have (`kernel::contact::MAX_CONTACTS`).
    #[expect(unsafe_code, reason = "MuJoCo's structs")]
    unsafe {
        let found = with_scene(|scene| {
            let bodies = [one, other].map(|geom| *(*model).geom_bodyid.add(geom as usize) as usize);
            let pair = scene.pair_of(bodies)?;
            let poses = bodies.map(|body| pose_at((*data).xpos, (*data).xmat, body));
            Some(write_contacts(contacts, scene.contacts(pair, poses)))
        });
        found.flatten().unwrap_or_else(|| {
            let own = OWN_BOXES.get().copied().flatten();
            own.map_or(0, |own| own(model, data, contacts, one, other, margin))
        })
    }
}

/// Position and rotation number `number` out of MuJoCo's arrays.
#[expect(unsafe_code, reason = "MuJoCo's arrays")]
unsafe fn pose_at(positions: *const f64, rotations: *const f64, number: usize) -> IsometryMatrix3<f64> {
    // SAFETY: the caller passes arrays that have three and nine numbers for each geom or body, and the number of one.
    unsafe {
        placement(
            slice::from_raw_parts(positions.add(3 * number), 3),
            slice::from_raw_parts(rotations.add(9 * number), 9),
        )
    }
}

/// Writes contacts, with their normals from the first geom to the second; returns their number.
#[expect(unsafe_code, reason = "MuJoCo's structs")]
unsafe fn write_contacts(room: *mut mjPreContact, found: impl Iterator<Item = WorldContact>) -> c_int {
    let mut count = 0;
    for contact in found {
        let (dist, pos, normal) = (contact.distance, contact.point.coords.into(), contact.normal.into());
        // SAFETY: the caller has room for all that can be found.
        unsafe { room.add(count).write(mjPreContact { dist, pos, normal, tangent: [0.0; 3] }) };
        count += 1;
    }
    count as c_int
}

/// Gives the bodies of a thread's own model of a scene, in order, their masses and bounding boxes.
///
/// # Panics
/// When there are not as many as the model has.
pub(super) fn set_scene_bodies(data: &mut MjData<Box<MjModel>>, patches: &[BodyPatch]) {
    // SAFETY: sizes, indices and addresses of the model stay as they are.
    #[expect(unsafe_code, reason = "whoever has the model could swap it")]
    let model = unsafe { data.model_mut() };
    assert_eq!(model.body_mass().len(), patches.len() + 1, "one patch per body except the world");
    for (number, patch) in patches.iter().enumerate() {
        // Body 0 is the world; geom 0 is the container.
        let (body, geom) = (number + 1, number + 1);
        model.body_mass_mut()[body] = patch.mass;
        model.body_inertia_mut()[body] = patch.inertia;
        model.body_ipos_mut()[body] = patch.centre;
        model.body_iquat_mut()[body] = patch.quaternion;
        model.geom_pos_mut()[geom] = patch.box_centre;
        model.geom_size_mut()[geom] = patch.box_half;
        let [a, b, c] = patch.box_half;
        model.geom_aabb_mut()[geom] = [0.0, 0.0, 0.0, a, b, c];
        model.geom_rbound_mut()[geom] = (a * a + b * b + c * c).sqrt();
        model.geom_friction_mut()[geom] = patch.friction;
        let (first, count) = (model.body_bvhadr()[body], model.body_bvhnum()[body]);
        for node in first..first + count {
            model.bvh_aabb_mut()[node as usize] = patch.bounds;
        }
    }
    data.set_const();
}

/// Gives the free object of a thread's own model a mass [kg], friction, and torsion [m].
pub(super) fn set_object(data: &mut MjData<Box<MjModel>>, object: &FreeObject, [mass, friction, torsion]: [f64; 3]) {
    // SAFETY: sizes, indices and addresses of the model stay as they are.
    #[expect(unsafe_code, reason = "whoever has the model could swap it")]
    let model = unsafe { data.model_mut() };
    model.body_mass_mut()[object.body] = mass;
    model.body_inertia_mut()[object.body] = object.inertia.map(|moment| mass * moment);
    // The value for rolling is used only by contacts of another kind.
    let friction = [friction, friction * torsion, 1e-4];
    match object.touched {
        Touched::Geom(geom) => model.geom_friction_mut()[geom] = friction,
        Touched::Flex(flex) => model.flex_friction_mut()[flex] = friction,
    }
    // SAFETY: 3 and 4 are kinds of contacts that MuJoCo has; it reads them when it makes a contact, no earlier.
    #[expect(unsafe_code, reason = "other numbers would be none")]
    let kind = unsafe {
        match object.touched {
            Touched::Geom(geom) => &mut model.geom_condim_mut()[geom],
            Touched::Flex(flex) => &mut model.flex_condim_mut()[flex],
        }
    };
    *kind = if torsion > 0.0 { 4 } else { 3 };
    data.set_const();
}

/// Gives the table of a thread's own model its friction.
pub(super) fn set_table_friction(data: &mut MjData<Box<MjModel>>, table: &Table, friction: f64) {
    // SAFETY: sizes, indices and addresses of the model stay as they are.
    #[expect(unsafe_code, reason = "whoever has the model could swap it")]
    let model = unsafe { data.model_mut() };
    for plane in table.planes {
        model.geom_friction_mut()[plane][0] = friction;
    }
}

/// The C library's own word for its version.
pub(super) fn libc_version() -> String {
    #[cfg(target_env = "gnu")]
    {
        #[expect(unsafe_code, reason = "glibc gives its version by a function only")]
        unsafe extern "C" {
            safe fn gnu_get_libc_version() -> *const std::ffi::c_char;
        }
        // SAFETY: glibc returns its own string, which lives as long as the process.
        #[expect(unsafe_code, reason = "a C string")]
        let version = unsafe { std::ffi::CStr::from_ptr(gnu_get_libc_version()) };
        format!("glibc {}", version.to_string_lossy())
    }
    #[cfg(not(target_env = "gnu"))]
    {
        std::env::consts::OS.to_owned()
    }
}

/// MuJoCo cannot continue after an error and ends the process with exit code 1 once this returns. Shards in work keep
/// their temporary names, so no partial file counts as finished. Warnings are counted in MuJoCo's own state, where the
/// stepping code reads them.
fn report_fatal(message: &MjLogMessage) {
    if message.level() == MjtLogLevel::mjLOG_ERROR {
        // The process ends here: no printer would print this.
        let _ = writeln!(std::io::stderr(), "error: MuJoCo gave up: {}", message.subject());
    }
}

/// A headless OpenGL context, current on the thread that made it for as long as it lives.
pub(super) struct GlContext {
    egl: Egl,
    display: egl::Display,
    context: egl::Context,
    /// Vendor and version of EGL.
    pub(super) egl_vendor: String,
    /// The driver's own name, as GL_RENDERER has it.
    pub(super) renderer: String,
    /// The driver's version, as GL_VERSION has it.
    pub(super) version: String,
    /// Longest side of an off-screen image [px].
    pub(super) largest: u32,
}

const PLATFORM_DEVICE: egl::Enum = 0x313F; // EGL_PLATFORM_DEVICE_EXT
const PLATFORM_SURFACELESS: egl::Enum = 0x31DD; // EGL_PLATFORM_SURFACELESS_MESA
const GL_RENDERER: u32 = 0x1F01;
const GL_VERSION: u32 = 0x1F02;
const GL_EXTENSIONS: u32 = 0x1F03;
const GL_MAX_RENDERBUFFER_SIZE: u32 = 0x84E8;
const GL_MODELVIEW: u32 = 0x1700;
const GL_TEXTURE: u32 = 0x1702;
const GL_TEXTURE0: u32 = 0x84C0;
const GL_TEXTURE1: u32 = 0x84C1;
const GL_TEXTURE_2D: u32 = 0x0DE1;
const GL_TEXTURE_MAG_FILTER: u32 = 0x2800;
const GL_TEXTURE_MIN_FILTER: u32 = 0x2801;
const GL_NEAREST: i32 = 0x2600;

/// OpenGL extensions whose absence ends the process in `mjr_makeContext`, and the one that float depth with near = 1
/// needs.
const NEEDED: [&str; 3] = ["GL_ARB_framebuffer_object", "GL_ARB_vertex_buffer_object", "GL_ARB_depth_buffer_float"];

impl GlContext {
    /// The first display that gives a desktop OpenGL context without a window: graphics devices in EGL's order, then
    /// Mesa's surfaceless platform, then the default display.
    pub(super) fn new() -> Result<Self, GlError> {
        // SAFETY: the library found under this name is the system's EGL; it is never unloaded.
        #[expect(unsafe_code, reason = "loading a shared library runs its initialisers")]
        let loaded = unsafe { Egl::load_required() };
        let egl = loaded.map_err(|error| GlError::NoLibrary { message: error.to_string() })?;
        let mut answers = Vec::new();
        for (name, display) in displays(&egl) {
            match open(&egl, display) {
                Ok(context) => {
                    let vendor = egl.query_string(Some(display), egl::VENDOR).map(text).unwrap_or_default();
                    let version = egl.query_string(Some(display), egl::VERSION).map(text).unwrap_or_default();
                    let mut made = Self {
                        egl,
                        display,
                        context,
                        egl_vendor: format!("{vendor} {version} ({name})"),
                        renderer: String::new(),
                        version: String::new(),
                        largest: 0,
                    };
                    made.ask_driver()?;
                    return Ok(made);
                }
                Err(error) => answers.push(format!("{name}: {error}")),
            }
        }
        Err(GlError::NoDisplay { message: answers.join("; ") })
    }

    /// Makes the context current on this thread again, where another one was used in between.
    pub(super) fn make_current(&self) -> Result<(), GlError> {
        if self.egl.get_current_context() == Some(self.context) {
            return Ok(());
        }
        self.egl
            .make_current(self.display, None, None, Some(self.context))
            .map_err(|error| GlError::Failed(format!("eglMakeCurrent: {error}")))
    }

    /// Makes lookups in a shadow map of `size` texels along each side read the texel that was drawn there, see
    /// [`upload`].
    fn align_shadow_map(&self, texture: u32, size: i32) -> Result<(), GlError> {
        let lacks = |missing: &str| GlError::Lacks { renderer: self.renderer.clone(), missing: missing.into() };
        let function = |name: &str| self.egl.get_proc_address(name).ok_or_else(|| lacks(name));
        let [bind, set, activate] =
            [function("glBindTexture")?, function("glTexParameteri")?, function("glActiveTexture")?];
        let [mode, load] = [function("glMatrixMode")?, function("glLoadMatrixf")?];
        // Texture coordinates from 0 to 1 go to the middle `size - 2` texels, by columns.
        let (scale, shift) = ((size - 2) as f32 / size as f32, 1.0 / size as f32);
        let drawn_from_read =
            [[scale, 0.0, 0.0, 0.0], [0.0, scale, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [shift, shift, 0.0, 1.0]];
        // SAFETY: OpenGL defines the functions with these types; the context is current on this thread and owns the
        // texture. MuJoCo binds a texture before it draws with it, selects a unit and a matrix before it changes them,
        // and has no matrix for this unit.
        #[expect(unsafe_code, reason = "OpenGL is reached through function pointers")]
        unsafe {
            let bind: extern "system" fn(u32, u32) = std::mem::transmute(bind);
            let set: extern "system" fn(u32, u32, i32) = std::mem::transmute(set);
            let activate: extern "system" fn(u32) = std::mem::transmute(activate);
            let mode: extern "system" fn(u32) = std::mem::transmute(mode);
            let load: extern "system" fn(*const f32) = std::mem::transmute(load);
            activate(GL_TEXTURE1);
            bind(GL_TEXTURE_2D, texture);
            set(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
            set(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
            mode(GL_TEXTURE);
            load(drawn_from_read.as_flattened().as_ptr());
            mode(GL_MODELVIEW);
            activate(GL_TEXTURE0);
        }
        Ok(())
    }

    /// Names and limits of the driver, and whether MuJoCo can work with it.
    fn ask_driver(&mut self) -> Result<(), GlError> {
        let lacks = |missing: &str| GlError::Lacks { renderer: "of this display".into(), missing: missing.into() };
        let get_string = self.egl.get_proc_address("glGetString").ok_or_else(|| lacks("glGetString"))?;
        let get_integer = self.egl.get_proc_address("glGetIntegerv").ok_or_else(|| lacks("glGetIntegerv"))?;
        // SAFETY: OpenGL defines both functions with these types; the context is current on this thread, and
        // strings of the driver live as long as it.
        #[expect(unsafe_code, reason = "OpenGL is reached through function pointers")]
        let (renderer, version, extensions, largest) = unsafe {
            let get_string: extern "system" fn(u32) -> *const c_char = std::mem::transmute(get_string);
            let get_integer: extern "system" fn(u32, *mut i32) = std::mem::transmute(get_integer);
            let named = |name| {
                let found = get_string(name);
                if found.is_null() { String::new() } else { text(CStr::from_ptr(found)) }
            };
            let mut largest = 0_i32;
            get_integer(GL_MAX_RENDERBUFFER_SIZE, &raw mut largest);
            (named(GL_RENDERER), named(GL_VERSION), named(GL_EXTENSIONS), largest)
        };
        self.renderer = renderer;
        self.version = version;
        self.largest = u32::try_from(largest).unwrap_or(0);
        let missing: Vec<&str> =
            NEEDED.into_iter().filter(|name| !extensions.split_whitespace().any(|present| present == *name)).collect();
        if missing.is_empty() {
            Ok(())
        } else {
            Err(GlError::Lacks { renderer: self.renderer.clone(), missing: missing.join(", ") })
        }
    }
}

impl Drop for GlContext {
    fn drop(&mut self) {
        // The display stays open: other threads may use it, and EGL closes it with the process.
        let _ = self.egl.make_current(self.display, None, None, None);
        let _ = self.egl.destroy_context(self.display, self.context);
    }
}

fn text(from: &CStr) -> String {
    from.to_string_lossy().into_owned()
}

/// Displays to try, each with the name of its platform.
fn displays(egl: &Egl) -> Vec<(String, egl::Display)> {
    let mut found = Vec::new();
    let extensions = egl.query_string(None, egl::EXTENSIONS).map(text).unwrap_or_default();
    let has = |name: &str| extensions.split_whitespace().any(|present| present == name);
    if let Some(get_platform_display) = egl.get_proc_address("eglGetPlatformDisplayEXT") {
        if has("EGL_EXT_platform_device") {
            for (number, device) in devices(egl).into_iter().enumerate() {
                let display = platform_display(get_platform_display, PLATFORM_DEVICE, device);
                found.extend(display.map(|display| (format!("device {number}"), display)));
            }
        }
        if has("EGL_MESA_platform_surfaceless") {
            let display = platform_display(get_platform_display, PLATFORM_SURFACELESS, std::ptr::null_mut());
            found.extend(display.map(|display| ("surfaceless".into(), display)));
        }
    }
    // SAFETY: EGL_DEFAULT_DISPLAY is always allowed.
    #[expect(unsafe_code, reason = "native displays are raw pointers")]
    let default = unsafe { egl.get_display(egl::DEFAULT_DISPLAY) };
    found.extend(default.map(|display| ("default display".into(), display)));
    found
}

/// Graphics devices, hardware or software, in EGL's order.
fn devices(egl: &Egl) -> Vec<*mut c_void> {
    const MAX: usize = 16;
    let Some(query) = egl.get_proc_address("eglQueryDevicesEXT") else { return Vec::new() };
    let (mut devices, mut count) = ([std::ptr::null_mut(); MAX], 0_i32);
    // SAFETY: EGL_EXT_device_enumeration defines this type; at most MOST devices are written.
    #[expect(unsafe_code, reason = "EGL's extensions are reached through function pointers")]
    let done = unsafe {
        let query: extern "system" fn(i32, *mut *mut c_void, *mut i32) -> egl::Boolean = std::mem::transmute(query);
        query(MAX as i32, devices.as_mut_ptr(), &raw mut count)
    };
    let count = if done == egl::TRUE { usize::try_from(count).unwrap_or(0).min(MAX) } else { 0 };
    devices[..count].to_vec()
}

fn platform_display(get: extern "system" fn(), platform: egl::Enum, native: *mut c_void) -> Option<egl::Display> {
    // SAFETY: EGL_EXT_platform_base defines this type; `native` is a device that EGL returned, or null where the
    // platform requires null.
    #[expect(unsafe_code, reason = "EGL's extensions are reached through function pointers")]
    unsafe {
        let get: extern "system" fn(egl::Enum, *mut c_void, *const egl::Int) -> *mut c_void = std::mem::transmute(get);
        let display = get(platform, native, std::ptr::null());
        (!display.is_null()).then(|| egl::Display::from_ptr(display))
    }
}

/// Opens a display and makes a context of desktop OpenGL current, without any surface: MuJoCo draws into its own buffer.
fn open(egl: &Egl, display: egl::Display) -> Result<egl::Context, egl::Error> {
    egl.initialize(display)?;
    egl.bind_api(egl::OPENGL_API)?;
    let wanted = [egl::SURFACE_TYPE, egl::PBUFFER_BIT, egl::RENDERABLE_TYPE, egl::OPENGL_BIT, egl::NONE];
    let config = egl.choose_first_config(display, &wanted)?.ok_or(egl::Error::BadConfig)?;
    // No version requested: MuJoCo draws with the compatibility profile.
    let context = egl.create_context(display, config, None, &[egl::NONE])?;
    if let Err(error) = egl.make_current(display, None, None, Some(context)) {
        let _ = egl.destroy_context(display, context);
        return Err(error);
    }
    Ok(context)
}

/// Paints the geoms of a scene by their numbers in the model; those past the last colour have that one.
pub(super) fn paint(scene: &mut MjvScene, colours: &[[f32; 3]]) {
    // SAFETY: only colour and shine change, and the renderer takes any numbers for these.
    #[expect(unsafe_code, reason = "other fields of a geom are indices that MuJoCo trusts")]
    for geom in unsafe { scene.geoms_mut() } {
        let own = usize::try_from(geom.objid).ok().and_then(|number| colours.get(number));
        let rgb = own.or(colours.last()).copied().unwrap_or_default();
        geom.rgba = [rgb[0], rgb[1], rgb[2], 1.0];
        (geom.specular, geom.shininess, geom.emission) = (0.2, 0.3, 0.0);
    }
}

/// MuJoCo's own GL objects for a model: its off-screen buffer and the mesh in the driver's memory. Depth is read as the
/// buffer has it, 1 = near: reversed z keeps the floating-point depth precise far away.
///
/// MuJoCo lights a fragment only where all four texels of the shadow map around it are farther from the light, and moves the map
/// back by 1.5 times the larger of its slopes s and t [m per texel]. It draws the map into all but an outermost ring of texels and
/// reads it as if it filled the texture, so that towards the border a lookup is off by up to a texel. Over four texels, one of them
/// off by a texel more, a lit plane is nearer than itself by up to 2 (s + t): moire. Here the map is read where it was drawn, at
/// the nearest texel, which is half a texel away, so that the plane is nearer by (s + t) / 2 at most.
///
/// The caller drops it before `gl` and while `gl` is current.
pub(super) fn upload(gl: &GlContext, model: &MjModel) -> Result<MjrContext, GlError> {
    gl.make_current()?;
    // SAFETY: `gl` is current on this thread, has what MuJoCo needs (`ask_driver`), and outlives the result.
    #[expect(unsafe_code, reason = "MuJoCo trusts that a GL context is current")]
    let mut context = unsafe {
        let mut context = MjrContext::new(model);
        context.ffi_mut().readDepthMap = mjtDepthMap::mjDEPTH_ZEROFAR as i32;
        context
    };
    match context.ffi().shadowTex {
        0 => {}
        shadows => gl.align_shadow_map(shadows, context.ffi().shadowSize)?,
    }
    context.set_buffer(MjtFramebuffer::mjFB_OFFSCREEN);
    if context.ffi().currentBuffer == MjtFramebuffer::mjFB_OFFSCREEN as i32 {
        Ok(context)
    } else {
        Err(GlError::Failed("MuJoCo's off-screen buffer is not complete".into()))
    }
}
