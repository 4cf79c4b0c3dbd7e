#include "graph/run/shim_exr.h"

#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <vector>

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfTiledInputFile.h>
#include <ImfTiledOutputFile.h>
#include <ImfVersion.h>

namespace
{

class MemoryOut : public Imf::OStream
{
  public:
    MemoryOut() : Imf::OStream("a chunk in memory")
    {
    }
    void write(const char c[], int n) override
    {
        if (bytes.size() < pos + size_t(n))
            bytes.resize(pos + size_t(n));
        std::memcpy(bytes.data() + pos, c, size_t(n));
        pos += size_t(n);
    }
    uint64_t tellp() override
    {
        return pos;
    }
    void seekp(uint64_t to) override
    {
        pos = to;
    }
    void word(uint64_t v, int n) /* little-endian */
    {
        char c[8];
        for (int i = 0; i < n; i++)
            c[i] = char(v >> 8 * i);
        write(c, n);
    }

    std::vector<char> bytes;

  private:
    size_t pos = 0;
};

class MemoryIn : public Imf::IStream
{
  public:
    explicit MemoryIn(const std::vector<char> &source) : Imf::IStream("a chunk in memory"), bytes(source)
    {
    }
    bool read(char c[], int n) override
    {
        if (n < 0 || size_t(n) > bytes.size() - pos)
            throw std::runtime_error("the chunk ends early");
        std::memcpy(c, bytes.data() + pos, size_t(n));
        pos += size_t(n);
        return pos < bytes.size();
    }
    uint64_t tellg() override
    {
        return pos;
    }
    void seekg(uint64_t to) override
    {
        pos = to < bytes.size() ? size_t(to) : bytes.size();
    }

  private:
    const std::vector<char> &bytes;
    size_t pos = 0;
};

Imf::PixelType pixel_type(rl_exr_pixel type)
{
    return type == RL_EXR_HALF ? Imf::HALF : type == RL_EXR_FLOAT ? Imf::FLOAT : Imf::UINT;
}

Imf::Header header_of(const rl_shim_exr_block &b)
{
    Imf::Header header(b.width, b.height);
    /* The two differ in the height of scanline chunks only, except that the library codes DWAA tiles with
     * deflate, which is slower and larger than the Huffman code that it has for scanlines and for DWAB tiles.
     */
    header.compression() = Imf::DWAB_COMPRESSION;
    if (b.dwa_level > 0)
        header.dwaCompressionLevel() = b.dwa_level;
    header.setTileDescription(Imf::TileDescription(unsigned(b.width), unsigned(b.height), Imf::ONE_LEVEL));
    for (size_t c = 0; c < b.n_channels; c++)
        header.channels().insert(b.layout[c].name, Imf::Channel(pixel_type(b.layout[c].type)));
    return header;
}

/* Slices that address rows of channels, one after the other. */
Imf::FrameBuffer rows_of_channels(const rl_shim_exr_block &b, char *plain)
{
    size_t row = 0, offset = 0;
    for (size_t c = 0; c < b.n_channels; c++)
        row += size_t(b.width) * (b.layout[c].type == RL_EXR_HALF ? 2 : 4);
    Imf::FrameBuffer frame;
    for (size_t c = 0; c < b.n_channels; c++) {
        size_t sample = b.layout[c].type == RL_EXR_HALF ? 2 : 4;
        frame.insert(b.layout[c].name, Imf::Slice(pixel_type(b.layout[c].type), plain + offset, sample, row));
        offset += size_t(b.width) * sample;
    }
    return frame;
}

void decompress(const rl_shim_exr_block &b, const void *packed, size_t size, void *plain)
{
    MemoryOut file;
    Imf::Header header = header_of(b);
    file.word(uint64_t(Imf::MAGIC), 4);
    file.word(uint64_t(Imf::EXR_VERSION | Imf::TILED_FLAG | Imf::LONG_NAMES_FLAG), 4);
    header.writeTo(file, true);
    file.word(file.tellp() + 8, 8); /* the table of chunks: one */
    for (int i = 0; i < 4; i++)
        file.word(0, 4); /* tile (0, 0) of level (0, 0) */
    file.word(size, 4);
    file.write(static_cast<const char *>(packed), int(size));

    MemoryIn in(file.bytes);
    Imf::TiledInputFile tiled(in, 0);
    tiled.setFrameBuffer(rows_of_channels(b, static_cast<char *>(plain)));
    tiled.readTile(0, 0);
}

size_t compress(const rl_shim_exr_block &b, const void *plain, void *packed, size_t limit)
{
    MemoryOut file;
    {
        Imf::TiledOutputFile out(file, header_of(b), 0);
        out.setFrameBuffer(
            rows_of_channels(b, static_cast<char *>(const_cast<void *>(plain)))); /* only read */
        out.writeTile(0, 0);
    }
    MemoryIn in(file.bytes);
    Imf::TiledInputFile tiled(in, 0);
    const char *data = nullptr;
    int dx = 0, dy = 0, lx = 0, ly = 0, size = 0;
    tiled.rawTileData(dx, dy, lx, ly, data, size);
    if (size_t(size) >= limit)
        return limit;
    std::memcpy(packed, data, size_t(size));
    return size_t(size);
}

/* Runs f; an exception becomes its text. */
template <class F> int guarded(char *message, size_t room, F f)
{
    try {
        f();
        return 0;
    } catch (const std::exception &e) {
        std::snprintf(message, room, "%s", e.what());
    } catch (...) {
        std::snprintf(message, room, "an unknown C++ exception");
    }
    return 1;
}

} // namespace

int rl_shim_exr_decompress(const rl_shim_exr_block *block, const void *packed, size_t size, void *plain,
                           char *message, size_t room)
{
    return guarded(message, room, [&] { decompress(*block, packed, size, plain); });
}

int rl_shim_exr_compress(const rl_shim_exr_block *block, const void *plain, void *packed, size_t limit,
                         size_t *size, char *message, size_t room)
{
    return guarded(message, room, [&] { *size = compress(*block, plain, packed, limit); });
}
