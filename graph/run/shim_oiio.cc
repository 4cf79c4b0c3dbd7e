#include "graph/run/shim_oiio.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>
#include <fontconfig/fontconfig.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <system_error>

#include <sys/mman.h>

#define EXPORT __attribute__((visibility("default")))

struct rl_oiio_file {
    std::unique_ptr<OIIO::ImageInput> input;
    std::string text; /* what the last attribute call gave out */
};

static int failed(const std::string &why, char *message, size_t size)
{
    snprintf(message, size, "%s", why.empty() ? "OpenImageIO does not say why" : why.c_str());
    for (char *p = message; *p; p++)
        if (*p == '\n')
            *p = p[1] ? ' ' : 0;
    return 1;
}

/* Inside a catch block. */
static int caught(char *message, size_t size)
{
    try {
        throw;
    } catch (const std::exception &e) {
        return failed(e.what(), message, size);
    } catch (...) {
        return failed("", message, size);
    }
}

static OIIO::TypeDesc type_of(rl_oiio_type type)
{
    static const OIIO::TypeDesc types[] = {OIIO::TypeUInt8, OIIO::TypeUInt16, OIIO::TypeHalf,
                                           OIIO::TypeFloat};
    return types[type];
}

static OIIO::ImageSpec spec_of(const rl_oiio_image *image)
{
    OIIO::ImageSpec spec(image->width, image->height, image->channels, type_of(image->type));
    spec.x = image->x;
    spec.y = image->y;
    spec.full_x = image->display[0];
    spec.full_y = image->display[1];
    spec.full_width = image->display[2];
    spec.full_height = image->display[3];
    for (size_t i = 0; i < image->attributes_n; i++) {
        const rl_oiio_attribute &a = image->attributes[i];
        if (a.text)
            spec.attribute(a.name, a.text);
        else
            spec.attribute(a.name, a.number);
    }
    return spec;
}

/* Most writers lose what goes wrong when they close, with a full disk the last part of a file; the one of
 * JPEG ends the process. So they never see the disk: they write through a proxy into a FILE of ours, which
 * remembers. Those that know no proxies, and TIFF's, which reads what it has written, get a file in memory,
 * which is copied. */
struct file_proxy : OIIO::Filesystem::IOFile {
    int error = 0; /* errno of the first failure */
    bool hidden;   /* that it is a FILE */

    file_proxy(FILE *f, bool hide) : IOFile(f, OIIO::Filesystem::IOProxy::Write), hidden(hide)
    {
    }

    /* Of a "file" JPEG's writer takes the FILE itself. */
    const char *proxytype() const override
    {
        return hidden ? "relit" : IOFile::proxytype();
    }

    size_t write(const void *data, size_t size) override
    {
        size_t done = IOFile::write(data, size);
        if (done != size && !error)
            error = errno ? errno : EIO;
        return done;
    }
};

struct file_closer {
    void operator()(FILE *f) const
    {
        fclose(f);
    }
};

using file_ptr = std::unique_ptr<FILE, file_closer>;

/* Everything to the writer; closes it. */
static bool put(OIIO::ImageOutput *output, const rl_oiio_image *image, const std::string &path)
{
    bool wide = image->type == RL_OIIO_HALF || image->type == RL_OIIO_FLOAT;
    return output->open(path, spec_of(image)) &&
           output->write_image(wide ? OIIO::TypeFloat : type_of(image->type), image->pixels) &&
           output->close();
}

/* Throws errno. */
static void copy(FILE *from, FILE *to)
{
    char block[65536];
    size_t n;
    rewind(from);
    while ((n = fread(block, 1, sizeof block, from)) > 0)
        if (fwrite(block, 1, n, to) != n)
            throw std::system_error(errno, std::generic_category());
    if (ferror(from))
        throw std::system_error(EIO, std::generic_category());
}

static int write_image(const rl_oiio_image *image, char *message, size_t size)
{
    try {
        file_ptr file(fopen(image->path, "wbe"));
        if (!file)
            return failed(strerror(errno), message, size);
        bool jpeg = OIIO::Strutil::starts_with(image->format, "jp");
        file_proxy proxy(file.get(), jpeg); /* outlives `output` */
        std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(image->format);
        if (!output)
            return failed(OIIO::geterror(), message, size);
        if (!output->supports("alpha") && (image->channels == 2 || image->channels == 4))
            return failed("the format has no alpha channel", message, size);
        bool tiff = OIIO::Strutil::starts_with(image->format, "tif");
        if (!tiff && output->supports("ioproxy") && output->set_ioproxy(&proxy)) {
            bool done = put(output.get(), image, image->path);
            if (proxy.error)
                return failed(strerror(proxy.error), message, size);
            if (!done)
                return failed(output->geterror(), message, size);
        } else {
            int fd = memfd_create("relit", MFD_CLOEXEC);
            file_ptr memory(fd < 0 ? nullptr : fdopen(fd, "rb"));
            if (!memory)
                return failed(strerror(errno), message, size);
            if (!put(output.get(), image, "/proc/self/fd/" + std::to_string(fd)))
                return failed(output->geterror(), message, size);
            copy(memory.get(), file.get());
        }
        errno = EIO;
        return fflush(file.get()) || ferror(file.get()) ? failed(strerror(errno), message, size) : 0;
    } catch (...) {
        return caught(message, size);
    }
}

/* "bmp:bmp;jpeg:jpg,jpeg;…" by format becomes "bmp,jpg,jpeg,…" of the formats that can be written. */
static std::string list_writable()
{
    std::string all(OIIO::get_string_attribute("extension_list")), out;
    std::string formats = "," + std::string(OIIO::get_string_attribute("output_format_list")) + ",";
    for (size_t start = 0; start < all.size();) {
        size_t end = std::min(all.find(';', start), all.size()), colon = all.find(':', start);
        if (colon < end && formats.find("," + all.substr(start, colon - start) + ",") != std::string::npos)
            out += (out.empty() ? "" : ",") + all.substr(colon + 1, end - colon - 1);
        start = end + 1;
    }
    return out;
}

static const char *writable()
{
    try {
        static const std::string list = list_writable();
        return list.c_str();
    } catch (...) {
        return "";
    }
}

static rl_oiio_type nearest_type(OIIO::TypeDesc type)
{
    switch (type.basetype) {
    case OIIO::TypeDesc::UINT8:
    case OIIO::TypeDesc::INT8:
        return RL_OIIO_U8;
    case OIIO::TypeDesc::HALF:
        return RL_OIIO_HALF;
    case OIIO::TypeDesc::UINT16:
    case OIIO::TypeDesc::INT16:
        return RL_OIIO_U16;
    default:
        return RL_OIIO_FLOAT;
    }
}

static void fill_info(const OIIO::ImageSpec &spec, rl_oiio_info *info)
{
    std::string names;
    for (const std::string &name : spec.channelnames)
        names += (names.empty() ? "" : ",") + name;
    *info = rl_oiio_info{};
    info->width = spec.width;
    info->height = spec.height;
    info->channels = spec.nchannels;
    info->x = spec.x;
    info->y = spec.y;
    info->display[0] = spec.full_x;
    info->display[1] = spec.full_y;
    info->display[2] = spec.full_width;
    info->display[3] = spec.full_height;
    info->type = nearest_type(spec.format);
    snprintf(info->names, sizeof info->names, "%s", names.c_str());
    snprintf(info->colorspace, sizeof info->colorspace, "%s",
             spec.get_string_attribute("oiio:ColorSpace").c_str());
}

static int open_image(const char *path, rl_oiio_file **out, rl_oiio_info *info, char *message, size_t size)
{
    *out = nullptr;
    try {
        std::unique_ptr<rl_oiio_file> file(new rl_oiio_file);
        file->input = OIIO::ImageInput::open(path);
        if (!file->input)
            return failed(OIIO::geterror(), message, size);
        fill_info(file->input->spec(), info);
        *out = file.release();
        return 0;
    } catch (...) {
        return caught(message, size);
    }
}

static int read_image(rl_oiio_file *file, float *pixels, char *message, size_t size)
{
    try {
        if (!file->input->read_image(0, 0, 0, file->input->spec().nchannels, OIIO::TypeFloat, pixels))
            return failed(file->input->geterror(), message, size);
        return 0;
    } catch (...) {
        return caught(message, size);
    }
}

static const char *read_attribute(rl_oiio_file *file, const char *name)
{
    try {
        file->text = file->input->spec().get_string_attribute(name).c_str();
        return file->text.c_str();
    } catch (...) {
        return "";
    }
}

static void close_image(rl_oiio_file *file)
{
    try {
        delete file;
    } catch (...) {
    }
}

/* The file of a font, found once. */
static std::string find_font(bool bold)
{
    std::string path;
    FcPattern *wanted = FcPatternCreate(), *got = nullptr;
    FcResult result = FcResultNoMatch;
    FcChar8 *file = nullptr;
    if (!wanted)
        return path;
    FcPatternAddString(wanted, FC_FAMILY, reinterpret_cast<const FcChar8 *>("DejaVu Sans"));
    FcPatternAddString(wanted, FC_FAMILY, reinterpret_cast<const FcChar8 *>("sans-serif"));
    FcPatternAddInteger(wanted, FC_WEIGHT, bold ? FC_WEIGHT_BOLD : FC_WEIGHT_REGULAR);
    FcPatternAddBool(wanted, FC_SCALABLE, FcTrue);
    FcConfigSubstitute(nullptr, wanted, FcMatchPattern);
    FcDefaultSubstitute(wanted);
    got = FcFontMatch(nullptr, wanted, &result);
    if (got && FcPatternGetString(got, FC_FILE, 0, &file) == FcResultMatch)
        path = reinterpret_cast<const char *>(file);
    if (got)
        FcPatternDestroy(got);
    FcPatternDestroy(wanted);
    return path;
}

static const std::string &font(int bold)
{
    static const std::string regular = find_font(false), heavy = find_font(true);
    return bold ? heavy : regular;
}

static const char no_font[] = "text needs a font (Debian: fonts-dejavu-core), and fontconfig finds none";

static int text_width(const char *text, int height, int bold, int *width, char *message, size_t size)
{
    try {
        if (font(bold).empty())
            return failed(no_font, message, size);
        OIIO::ROI roi = OIIO::ImageBufAlgo::text_size(text, height, font(bold));
        *width = roi.defined() && roi.xend > 0 ? roi.xend : 0; /* of nothing, its box is inside out */
        if (!roi.defined() && OIIO::has_error())
            return failed(OIIO::geterror(), message, size);
        return 0;
    } catch (...) {
        return caught(message, size);
    }
}

static int draw_text(const char *text, int height, int bold, float *plane, int plane_width, int plane_height,
                     int x, int baseline, char *message, size_t size)
{
    try {
        if (font(bold).empty())
            return failed(no_font, message, size);
        const float white = 1;
        OIIO::ImageBuf image(OIIO::ImageSpec(plane_width, plane_height, 1, OIIO::TypeFloat), plane);
        if (!OIIO::ImageBufAlgo::render_text(image, x, baseline, text, height, font(bold),
                                             OIIO::cspan<float>(&white, 1)))
            return failed(image.geterror(), message, size);
        return 0;
    } catch (...) {
        return caught(message, size);
    }
}

extern "C" EXPORT const rl_oiio_module *rl_oiio_module_get(void)
{
    static const rl_oiio_module module = {RL_OIIO_VERSION, write_image, writable,   open_image, read_image,
                                          read_attribute,  close_image, text_width, draw_text};
    return &module;
}
