#include "graph/run/shim_ocio.h"

#include <OpenColorIO/OpenColorIO.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <new>
#include <string>
#include <vector>

#include "graph/base/alloc.h"
#include "graph/run/shim_ocio_ops.hh"

namespace OCIO = OCIO_NAMESPACE;

struct rl_ocio {
    OCIO::ConstConfigRcPtr config;
};

struct rl_ocio_transform {
    OCIO::ConstProcessorRcPtr processor; /* optimized */
    OCIO::ConstCPUProcessorRcPtr cpu;
};

/* Optimizations that change no value: without tables for inverses and fast log, exp and pow. */
static const OCIO::OptimizationFlags EXACT = OCIO::OPTIMIZATION_LOSSLESS;

rl_code rl_shim_caught(rl_error *err)
{
    try {
        throw;
    } catch (const std::bad_alloc &) {
        return rl_fail_memory(err, 0);
    } catch (const std::exception &e) {
        return rl_fail(err, RL_E_COLOR, rl_where{}, "OpenColorIO: %s", e.what());
    } catch (...) {
        return rl_fail(err, RL_E_COLOR, rl_where{}, "OpenColorIO failed without saying why");
    }
}

/* Places a C++ object in counted memory; NULL when that is out. */
template <typename T> static T *make()
{
    void *room = rl_malloc(sizeof(T));
    return room ? new (room) T() : nullptr;
}

template <typename T> static void destroy(T **object)
{
    if (object && *object) {
        (*object)->~T();
        rl_free(*object);
        *object = nullptr;
    }
}

extern "C" rl_code rl_ocio_open(const char *path, rl_ocio **out, rl_error *err)
{
    *out = nullptr;
    rl_ocio *ocio = make<rl_ocio>();
    if (!ocio)
        return rl_fail_memory(err, sizeof *ocio);
    rl_code code = RL_OK;
    try {
        /* What OpenColorIO prints otherwise, it also throws. */
        OCIO::SetLoggingLevel(OCIO::LOGGING_LEVEL_NONE);
        ocio->config = OCIO::Config::CreateFromFile(path);
    } catch (const std::exception &e) {
        code = rl_fail_file(err, RL_E_COLOR, path, "%s", e.what());
    } catch (...) {
        code = rl_fail_file(err, RL_E_COLOR, path, "OpenColorIO cannot read it");
    }
    if (code != RL_OK)
        destroy(&ocio);
    *out = ocio;
    return code;
}

extern "C" void rl_ocio_free(rl_ocio **ocio)
{
    destroy(ocio);
}

extern "C" rl_code rl_ocio_validate(const rl_ocio *ocio, rl_error *err)
{
    try {
        ocio->config->validate();
        return RL_OK;
    } catch (...) {
        return rl_shim_caught(err);
    }
}

/* ---- names ------------------------------------------------------------------------------------------- */

static int count_names(const OCIO::Config &config, rl_ocio_list what, const char *of)
{
    switch (what) {
    case RL_OCIO_SPACES:
        return config.getNumColorSpaces(OCIO::SEARCH_REFERENCE_SPACE_ALL, OCIO::COLORSPACE_ALL);
    case RL_OCIO_DISPLAYS:
        return config.getNumDisplaysAll();
    case RL_OCIO_VIEWS:
        return config.getNumViews(of);
    case RL_OCIO_LOOKS:
        return config.getNumLooks();
    case RL_OCIO_ROLES:
        return config.getNumRoles();
    }
    return 0;
}

static const char *name_at(const OCIO::Config &config, rl_ocio_list what, const char *of, int i)
{
    switch (what) {
    case RL_OCIO_SPACES:
        return config.getColorSpaceNameByIndex(OCIO::SEARCH_REFERENCE_SPACE_ALL, OCIO::COLORSPACE_ALL, i);
    case RL_OCIO_DISPLAYS:
        return config.getDisplayAll(i);
    case RL_OCIO_VIEWS:
        return config.getView(of, i);
    case RL_OCIO_LOOKS:
        return config.getLookNameByIndex(i);
    case RL_OCIO_ROLES:
        return config.getRoleName(i);
    }
    return "";
}

/* name(i) for i < n, copied into the arena. */
template <typename T>
static rl_code copy_names(size_t n, T name, rl_arena *arena, rl_ocio_names *out, rl_error *err)
{
    auto names = static_cast<const char **>(rl_arena_array(arena, n + 1, sizeof(char *)));
    if (!names)
        return rl_fail_memory(err, n * sizeof(char *));
    for (size_t i = 0; i < n; i++)
        if (!(names[i] = rl_arena_strdup(arena, name(i))))
            return rl_fail_memory(err, 0);
    out->names = names;
    out->n = n;
    return RL_OK;
}

extern "C" rl_code rl_ocio_list_names(const rl_ocio *ocio, rl_ocio_list what, const char *of, rl_arena *arena,
                                      rl_ocio_names *out, rl_error *err)
{
    *out = rl_ocio_names{};
    try {
        const OCIO::Config &config = *ocio->config;
        auto name = [&](size_t i) { return name_at(config, what, of, int(i)); };
        return copy_names(size_t(count_names(config, what, of)), name, arena, out, err);
    } catch (...) {
        return rl_shim_caught(err);
    }
}

/* ---- content ------------------------------------------------------------------------------------------ */

extern "C" rl_code rl_ocio_fingerprint(const rl_ocio *ocio, char *out, size_t size, rl_error *err)
{
    try { /* with a context it would have the inodes of files in it, which differ from machine to machine */
        const char *id = ocio->config->getCacheID(OCIO::ConstContextRcPtr());
        std::strncpy(out, id ? id : "", size - 1);
        out[size - 1] = 0;
        return RL_OK;
    } catch (...) {
        return rl_shim_caught(err);
    }
}

using file_names = std::vector<std::string>;

static void add_files(const OCIO::Config &config, const OCIO::ConstTransformRcPtr &transform, file_names &out)
{
    if (auto group = OCIO::DynamicPtrCast<const OCIO::GroupTransform>(transform))
        for (int i = 0; i < group->getNumTransforms(); i++)
            add_files(config, group->getTransform(i), out);
    if (auto file = OCIO::DynamicPtrCast<const OCIO::FileTransform>(transform)) {
        try {
            std::string path = config.getCurrentContext()->resolveFileLocation(file->getSrc());
            if (std::find(out.begin(), out.end(), path) == out.end())
                out.push_back(path);
        } catch (const OCIO::Exception &) { /* not there: whoever uses the transform will hear of it */
        }
    }
}

static file_names all_files(const OCIO::Config &config)
{
    file_names out;
    for (int i = 0; i < count_names(config, RL_OCIO_SPACES, nullptr); i++) {
        auto space = config.getColorSpace(name_at(config, RL_OCIO_SPACES, nullptr, i));
        add_files(config, space->getTransform(OCIO::COLORSPACE_DIR_TO_REFERENCE), out);
        add_files(config, space->getTransform(OCIO::COLORSPACE_DIR_FROM_REFERENCE), out);
    }
    for (int i = 0; i < config.getNumLooks(); i++) {
        auto look = config.getLook(config.getLookNameByIndex(i));
        add_files(config, look->getTransform(), out);
        add_files(config, look->getInverseTransform(), out);
    }
    for (int i = 0; i < config.getNumViewTransforms(); i++) {
        auto view = config.getViewTransform(config.getViewTransformNameByIndex(i));
        add_files(config, view->getTransform(OCIO::VIEWTRANSFORM_DIR_TO_REFERENCE), out);
        add_files(config, view->getTransform(OCIO::VIEWTRANSFORM_DIR_FROM_REFERENCE), out);
    }
    for (int i = 0; i < config.getNumNamedTransforms(OCIO::NAMEDTRANSFORM_ALL); i++) {
        auto named =
            config.getNamedTransform(config.getNamedTransformNameByIndex(OCIO::NAMEDTRANSFORM_ALL, i));
        add_files(config, named->getTransform(OCIO::TRANSFORM_DIR_FORWARD), out);
        add_files(config, named->getTransform(OCIO::TRANSFORM_DIR_INVERSE), out);
    }
    return out;
}

extern "C" rl_code rl_ocio_files(const rl_ocio *ocio, rl_arena *arena, rl_ocio_names *out, rl_error *err)
{
    *out = rl_ocio_names{};
    try {
        file_names files = all_files(*ocio->config);
        auto name = [&](size_t i) { return files[i].c_str(); };
        return copy_names(files.size(), name, arena, out, err);
    } catch (...) {
        return rl_shim_caught(err);
    }
}

extern "C" const char *rl_ocio_space(const rl_ocio *ocio, const char *name)
{
    try {
        OCIO::ConstColorSpaceRcPtr space = ocio->config->getColorSpace(name);
        return space ? space->getName() : nullptr;
    } catch (...) {
        return nullptr;
    }
}

extern "C" bool rl_ocio_is_data(const rl_ocio *ocio, const char *name)
{
    try {
        OCIO::ConstColorSpaceRcPtr space = ocio->config->getColorSpace(name);
        return space && space->isData();
    } catch (...) {
        return false;
    }
}

/* ---- transforms -------------------------------------------------------------------------------------- */

static OCIO::ConstProcessorRcPtr make_processor(const OCIO::Config &config, const rl_ocio_request *request)
{
    OCIO::GroupTransformRcPtr group = OCIO::GroupTransform::Create();
    if (request->look) {
        OCIO::LookTransformRcPtr look = OCIO::LookTransform::Create();
        look->setSrc(request->from);
        look->setDst(request->from);
        look->setLooks(request->look);
        group->appendTransform(look);
    }
    if (request->to) {
        OCIO::ColorSpaceTransformRcPtr space = OCIO::ColorSpaceTransform::Create();
        space->setSrc(request->from);
        space->setDst(request->to);
        group->appendTransform(space);
    } else {
        OCIO::DisplayViewTransformRcPtr view = OCIO::DisplayViewTransform::Create();
        view->setSrc(request->from);
        view->setDisplay(request->display);
        view->setView(request->view);
        group->appendTransform(view);
    }
    return config.getProcessor(group);
}

extern "C" rl_code rl_ocio_transform_new(const rl_ocio *ocio, const rl_ocio_request *request,
                                         rl_ocio_transform **out, rl_error *err)
{
    *out = nullptr;
    rl_ocio_transform *transform = make<rl_ocio_transform>();
    if (!transform)
        return rl_fail_memory(err, sizeof *transform);
    rl_code code = RL_OK;
    try {
        OCIO::ConstProcessorRcPtr whole = make_processor(*ocio->config, request);
        /* Inverses of tables become tables, everything else stays exact. */
        transform->processor = whole->getOptimizedProcessor(
            OCIO::OptimizationFlags(EXACT | OCIO::OPTIMIZATION_LUT_INV_FAST | OCIO::OPTIMIZATION_COMP_LUT1D |
                                    OCIO::OPTIMIZATION_NO_DYNAMIC_PROPERTIES));
        transform->cpu = transform->processor->getOptimizedCPUProcessor(EXACT);
    } catch (...) {
        code = rl_shim_caught(err);
    }
    if (code != RL_OK)
        destroy(&transform);
    *out = transform;
    return code;
}

extern "C" void rl_ocio_transform_free(rl_ocio_transform **transform)
{
    destroy(transform);
}

extern "C" rl_code rl_ocio_apply(const rl_ocio_transform *transform, float *r, float *g, float *b, size_t n,
                                 rl_error *err)
{
    if (n == 0)
        return RL_OK;
    try {
        OCIO::PlanarImageDesc image(r, g, b, nullptr, long(n), 1);
        transform->cpu->apply(image);
        return RL_OK;
    } catch (...) {
        return rl_shim_caught(err);
    }
}

extern "C" rl_code rl_ocio_shader(const rl_ocio_transform *transform, rl_arena *arena, char **out,
                                  rl_error *err)
{
    *out = nullptr;
    try {
        OCIO::GpuShaderDescRcPtr desc = OCIO::GpuShaderDesc::CreateShaderDesc();
        desc->setLanguage(OCIO::GPU_LANGUAGE_GLSL_4_0);
        transform->processor->getOptimizedGPUProcessor(EXACT)->extractGpuShaderInfo(desc);
        *out = rl_arena_strdup(arena, desc->getShaderText());
        return *out ? RL_OK : rl_fail_memory(err, 0);
    } catch (...) {
        return rl_shim_caught(err);
    }
}

extern "C" rl_code rl_ocio_ops(const rl_ocio_transform *transform, rl_arena *arena, rl_op **ops, size_t *n,
                               rl_error *err)
{
    *ops = nullptr;
    *n = 0;
    try {
        return rl_shim_ops(*transform->processor->createGroupTransform(), arena, ops, n, err);
    } catch (...) {
        return rl_shim_caught(err);
    }
}

/* ---- primaries --------------------------------------------------------------------------------------- */

static bool linear_matrix(const rl_op *ops, size_t n, double m[9])
{
    static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    if (n == 0) {
        memcpy(m, identity, sizeof identity);
        return true;
    }
    if (n != 1 || ops[0].kind != RL_OP_MATRIX)
        return false;
    for (double offset : ops[0].u.matrix.offset)
        if (offset != 0)
            return false;
    memcpy(m, ops[0].u.matrix.m, sizeof identity);
    return true;
}

extern "C" rl_code rl_ocio_to_aces(const rl_ocio *ocio, const char *space, bool *linear, double m[9],
                                   rl_error *err)
{
    *linear = false;
    if (rl_ocio_is_data(ocio, space) || !ocio->config->hasRole(OCIO::ROLE_INTERCHANGE_SCENE))
        return RL_OK;
    rl_arena arena = {};
    rl_ocio_transform *transform = nullptr;
    rl_op *ops = nullptr;
    size_t n = 0;
    rl_ocio_request request = {};
    request.from = space;
    request.to = OCIO::ROLE_INTERCHANGE_SCENE;
    rl_code code = rl_ocio_transform_new(ocio, &request, &transform, err);
    if (code == RL_OK)
        code = rl_ocio_ops(transform, &arena, &ops, &n, err);
    if (code == RL_OK)
        *linear = linear_matrix(ops, n, m);
    rl_ocio_transform_free(&transform);
    rl_arena_free(&arena);
    return code;
}
