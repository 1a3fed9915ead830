#include "frontends/logs/compression.h"

#include <bzlib.h>
#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

#include "core/error.h"

namespace lodestone {
namespace {

/// Feeds a decoder until the bytes are used up or the stream has ended. `step(in, in_size, out, out_size)` sets both
/// sizes to the number of used and written bytes, and returns true at the end of the packed stream.
template <class Step>
void stream(std::span<const std::uint8_t> packed, std::uint64_t size, UnpackedSize meaning,
            std::vector<std::uint8_t>& out, const Step& step) {
  std::size_t read = 0, written = 0;
  bool ended = false;
  out.resize(static_cast<std::size_t>(std::min<std::uint64_t>(size, std::max<std::size_t>(65536, 4 * packed.size()))));
  while (!ended) {
    if (written == out.size() && out.size() < size) {
      out.resize(static_cast<std::size_t>(std::min<std::uint64_t>(size, 2 * out.size())));
    }
    std::size_t in_size = packed.size() - read, out_size = out.size() - written;
    ended = step(packed.data() + read, in_size, out.data() + written, out_size);
    read += in_size;
    written += out_size;
    if (ended || in_size > 0 || out_size > 0) continue;
    if (written == size && read < packed.size()) {
      throw CompressionError(fmt::format("it unpacks to more than the announced {} bytes", size));
    }
    if (meaning == UnpackedSize::cut_off) break;
    throw CompressionError("it ends before the end of its content");
  }
  out.resize(written);
  if (meaning == UnpackedSize::exact && written != size) {
    throw CompressionError(fmt::format("it unpacks to {} bytes; expected {}", written, size));
  }
}

void unpack_lz4(std::span<const std::uint8_t> packed, std::uint64_t size, UnpackedSize meaning,
                std::vector<std::uint8_t>& out) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) throw std::bad_alloc();
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> guard(context, LZ4F_freeDecompressionContext);
  stream(packed, size, meaning, out,
         [&](const std::uint8_t* in, std::size_t& in_size, std::uint8_t* to, std::size_t& to_size) {
           const std::size_t result = LZ4F_decompress(context, to, &to_size, in, &in_size, nullptr);
           if (LZ4F_isError(result)) throw CompressionError(LZ4F_getErrorName(result));
           return result == 0;
         });
}

void unpack_zstd(std::span<const std::uint8_t> packed, std::uint64_t size, UnpackedSize meaning,
                 std::vector<std::uint8_t>& out) {
  const std::unique_ptr<ZSTD_DStream, std::size_t (*)(ZSTD_DStream*)> context(ZSTD_createDStream(), ZSTD_freeDStream);
  if (context == nullptr) throw std::bad_alloc();
  stream(packed, size, meaning, out,
         [&](const std::uint8_t* in, std::size_t& in_size, std::uint8_t* to, std::size_t& to_size) {
           ZSTD_inBuffer input{in, in_size, 0};
           ZSTD_outBuffer output{to, to_size, 0};
           const std::size_t result = ZSTD_decompressStream(context.get(), &output, &input);
           if (ZSTD_isError(result)) throw CompressionError(ZSTD_getErrorName(result));
           in_size = input.pos;
           to_size = output.pos;
           return result == 0 && input.pos == input.size;  // there may be several frames
         });
}

void unpack_bz2(std::span<const std::uint8_t> packed, std::uint64_t size, UnpackedSize meaning,
                std::vector<std::uint8_t>& out) {
  bz_stream context{};
  if (BZ2_bzDecompressInit(&context, 0, 0) != BZ_OK) throw std::bad_alloc();
  const std::unique_ptr<bz_stream, int (*)(bz_stream*)> guard(&context, BZ2_bzDecompressEnd);
  stream(packed, size, meaning, out,
         [&](const std::uint8_t* in, std::size_t& in_size, std::uint8_t* to, std::size_t& to_size) {
           context.next_in = const_cast<char*>(reinterpret_cast<const char*>(in));
           context.avail_in = static_cast<unsigned>(std::min<std::size_t>(in_size, 1U << 30));
           context.next_out = reinterpret_cast<char*>(to);
           context.avail_out = static_cast<unsigned>(std::min<std::size_t>(to_size, 1U << 30));
           const unsigned in_before = context.avail_in, out_before = context.avail_out;
           const int result = BZ2_bzDecompress(&context);
           if (result != BZ_OK && result != BZ_STREAM_END)
             throw CompressionError(fmt::format("bzip2 error {}", result));
           in_size = in_before - context.avail_in;
           to_size = out_before - context.avail_out;
           return result == BZ_STREAM_END;
         });
}

std::vector<std::uint8_t> pack_bz2(std::span<const std::uint8_t> bytes) {
  auto size = static_cast<unsigned>(bytes.size() + bytes.size() / 100 + 600);  // bzip2's bound of the packed size
  std::vector<std::uint8_t> packed(size);
  constexpr int block_size = 9;  // of 100 kB
  if (BZ2_bzBuffToBuffCompress(reinterpret_cast<char*>(packed.data()), &size,
                               const_cast<char*>(reinterpret_cast<const char*>(bytes.data())),
                               static_cast<unsigned>(bytes.size()), block_size, 0, 0) != BZ_OK) {
    throw std::logic_error("packing failed");
  }
  packed.resize(size);
  return packed;
}

using File = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

}  // namespace

void unpack(Codec codec, std::span<const std::uint8_t> packed, std::uint64_t size, UnpackedSize meaning,
            std::vector<std::uint8_t>& out) {
  switch (codec) {
    case Codec::lz4:
      return unpack_lz4(packed, size, meaning, out);
    case Codec::zstd:
      return unpack_zstd(packed, size, meaning, out);
    case Codec::bz2:
      return unpack_bz2(packed, size, meaning, out);
    case Codec::none:
      break;
  }
  if (packed.size() > size || (meaning == UnpackedSize::exact && packed.size() != size)) {
    throw CompressionError(fmt::format("its size is {} bytes; expected {}", packed.size(), size));
  }
  out.assign(packed.begin(), packed.end());
}

std::vector<std::uint8_t> pack(Codec codec, std::span<const std::uint8_t> bytes) {
  if (codec == Codec::none) return {bytes.begin(), bytes.end()};
  if (codec == Codec::bz2) return pack_bz2(bytes);
  LZ4F_preferences_t frame{};
  frame.frameInfo.blockMode = LZ4F_blockIndependent;  // rosbag's reader supports only this mode
  frame.frameInfo.contentChecksumFlag = LZ4F_contentChecksumEnabled;
  std::vector<std::uint8_t> packed(codec == Codec::lz4 ? LZ4F_compressFrameBound(bytes.size(), &frame)
                                                       : ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      codec == Codec::lz4
          ? LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), &frame)
          : ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), ZSTD_CLEVEL_DEFAULT);
  if (codec == Codec::lz4 ? LZ4F_isError(size) != 0 : ZSTD_isError(size) != 0) throw std::logic_error("packing failed");
  packed.resize(size);
  return packed;
}

bool starts_like_zstd(std::span<const std::uint8_t> bytes) {
  static constexpr std::uint8_t magic[] = {0x28, 0xB5, 0x2F, 0xFD};
  return bytes.size() >= 4 && std::memcmp(bytes.data(), magic, 4) == 0;
}

std::span<const std::uint8_t> unpacked_cdr(std::span<const std::uint8_t> bytes, std::vector<std::uint8_t>& unpacked) {
  if (!starts_like_zstd(bytes)) return bytes;
  unpack(Codec::zstd, bytes, largest_message, UnpackedSize::at_most, unpacked);
  return unpacked;
}

void unpack_zstd_file(const std::string& path, const std::string& out, std::uint64_t room,
                      const std::function<void(std::span<const std::uint8_t>)>& check) {
  const File from(std::fopen(path.c_str(), "rb"), std::fclose);
  const File to(std::fopen(out.c_str(), "wb"), std::fclose);
  if (from == nullptr) throw InputError(path + ": cannot be opened for reading; check its permissions");
  if (to == nullptr)
    throw InputError(
        fmt::format("{}: cannot be written, but is required to unpack {}; set TMPDIR to another folder", out, path));
  const std::unique_ptr<ZSTD_DStream, std::size_t (*)(ZSTD_DStream*)> context(ZSTD_createDStream(), ZSTD_freeDStream);
  if (context == nullptr) throw std::bad_alloc();
  std::vector<std::uint8_t> input(ZSTD_DStreamInSize()), output(ZSTD_DStreamOutSize());
  ZSTD_outBuffer piece{output.data(), output.size(), 0};
  std::uint64_t written = 0;
  const auto write_piece = [&] {
    if (written == 0) check({output.data(), piece.pos});
    written += piece.pos;
    if (written > room) {
      throw InputError(
          fmt::format("{}: the unpacked log exceeds the {:.1f} MB that are free in {}; set TMPDIR to a folder with "
                      "more space, or unpack the file with 'zstd -d'",
                      path, static_cast<double>(room) * 1e-6, std::filesystem::path(out).parent_path().string()));
    }
    if (std::fwrite(output.data(), 1, piece.pos, to.get()) != piece.pos || std::fflush(to.get()) != 0) {
      throw InputError(fmt::format("{}: the disk is full while unpacking {}; set TMPDIR to another folder", out, path));
    }
    piece.pos = 0;
  };
  // Written only when full: the first piece must be long enough to recognize the content of many small frames.
  while (const std::size_t count = std::fread(input.data(), 1, input.size(), from.get())) {
    bool more = true;  // the decoder may contain output that did not fit into the last piece
    for (ZSTD_inBuffer in{input.data(), count, 0}; in.pos < in.size || more;) {
      const std::size_t result = ZSTD_decompressStream(context.get(), &piece, &in);
      if (ZSTD_isError(result)) {
        throw InputError(fmt::format("{}: its zstd compression is damaged near byte {} ({})", path,
                                     std::ftell(from.get()), ZSTD_getErrorName(result)));
      }
      more = piece.pos == piece.size;
      if (more) write_piece();
    }
  }
  write_piece();
}

}  // namespace lodestone
