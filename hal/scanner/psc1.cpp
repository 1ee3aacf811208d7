#include "hal/scanner/psc1.hpp"

#include "hal/base/crc32c.hpp"
#include "hal/base/little_endian.hpp"
#include "hal/base/printable_text.hpp"

#include <algorithm>

namespace moldloft::hal::psc1 {
namespace {

constexpr std::uint32_t magic = 0x31435350;  // "PSC1" as it stands in the bytes
constexpr std::size_t crc_covers = 24;       // bytes of the header before its CRC

// A message under construction: the payload goes in behind the place of the header, finish() writes what
// depends on it.
class Message {
 public:
  Message(Type type, std::uint32_t request_id, std::span<std::byte> out) noexcept
      : out_{out},
        header_{.type = type, .request_id = request_id},
        payload_{out.subspan(std::min(out.size(), header_size))} {}

  ByteWriter& payload() noexcept { return payload_; }

  std::size_t finish(std::uint64_t acquired_ns = 0) noexcept {
    if (out_.size() < header_size || !payload_.ok()) return 0;
    header_.acquired_ns = acquired_ns;
    header_.payload_length = static_cast<std::uint32_t>(payload_.used());
    encode_header(header_, out_.first<header_size>());
    if (header_.payload_length == 0) return header_size;
    payload_.put(crc32c(out_.subspan(header_size, header_.payload_length)));
    return payload_.ok() ? header_size + payload_.used() : 0;
  }

 private:
  std::span<std::byte> out_;
  Header header_;
  ByteWriter payload_;
};

bool known(Status status) noexcept { return status <= Status::timeout; }

// A field read as the integer that it is on the wire becomes an enumerator only if there is one.
template <typename T>
std::expected<T, Flaw> checked(const T& message, std::size_t size, std::size_t expected_size,
                               bool content_good) {
  if (size != expected_size) return std::unexpected{Flaw::payload_size};
  if (!content_good) return std::unexpected{Flaw::content};
  return message;
}

}  // namespace

std::string_view to_string(Flaw flaw) {
  switch (flaw) {
    case Flaw::none:
      return "no flaw";
    case Flaw::too_short:
      return "too few bytes";
    case Flaw::magic:
      return "does not begin with PSC1";
    case Flaw::header_crc:
      return "header CRC wrong";
    case Flaw::version:
      return "unknown protocol version";
    case Flaw::type:
      return "unknown message type";
    case Flaw::length:
      return "payload longer than allowed";
    case Flaw::payload_crc:
      return "payload CRC wrong";
    case Flaw::payload_size:
      return "payload size does not fit its type";
    case Flaw::content:
      return "a field holds an impossible value";
  }
  return "unknown flaw";
}

std::string_view to_string(Encoding encoding) { return encoding == Encoding::int16 ? "int16" : "float32"; }

std::optional<Encoding> encoding_named(std::string_view name) {
  for (const Encoding encoding : {Encoding::int16, Encoding::float32}) {
    if (to_string(encoding) == name) return encoding;
  }
  return std::nullopt;
}

std::string_view to_string(Status status) {
  constexpr std::array<std::string_view, 7> names = {"OK",   "BAD_STATE",    "BAD_ARGUMENT", "UNSUPPORTED",
                                                     "BUSY", "SENSOR_FAULT", "TIMEOUT"};
  return names[std::min<std::size_t>(static_cast<std::size_t>(status), names.size() - 1)];
}

// ---- headers

void encode_header(const Header& header, std::span<std::byte, header_size> out) noexcept {
  ByteWriter to{out};
  to.put(magic);
  to.put(protocol_version);
  to.put(static_cast<std::uint8_t>(header.type));
  to.put(header.flags);
  to.put(header.payload_length);
  to.put(header.request_id);
  to.put(header.acquired_ns);
  to.put(crc32c(out.first<crc_covers>()));
  to.put(std::uint32_t{0});
}

std::expected<Header, Flaw> decode_header(std::span<const std::byte, header_size> in) noexcept {
  ByteReader from{in};
  if (from.get<std::uint32_t>() != magic) return std::unexpected{Flaw::magic};
  const auto header_version = from.get<std::uint8_t>();
  const auto type = from.get<std::uint8_t>();
  Header header{.type = static_cast<Type>(type)};
  header.flags = from.get<std::uint16_t>();
  header.payload_length = from.get<std::uint32_t>();
  header.request_id = from.get<std::uint32_t>();
  header.acquired_ns = from.get<std::uint64_t>();
  if (from.get<std::uint32_t>() != crc32c(in.first<crc_covers>())) return std::unexpected{Flaw::header_crc};
  // The reserved word lies outside the CRC: it must be zero, or a flipped bit in it would pass.
  if (from.get<std::uint32_t>() != 0) return std::unexpected{Flaw::content};
  if (header_version != protocol_version) return std::unexpected{Flaw::version};
  if (type < static_cast<std::uint8_t>(Type::hello) || type > static_cast<std::uint8_t>(Type::reset)) {
    return std::unexpected{Flaw::type};
  }
  if (header.payload_length > max_payload) return std::unexpected{Flaw::length};
  return header;
}

// ---- encoders

std::size_t encode(std::uint32_t request_id, const HelloRequest& hello, std::span<std::byte> out) noexcept {
  Message message{Type::hello, request_id, out};
  message.payload().put(hello.version_min);
  message.payload().put(hello.version_max);
  message.payload().put(std::uint16_t{0});
  return message.finish();
}

std::size_t encode(std::uint32_t request_id, const HelloReply& hello, std::span<std::byte> out) noexcept {
  Message message{Type::hello, request_id, out};
  auto& to = message.payload();
  to.put(static_cast<std::uint16_t>(hello.status));
  to.put(hello.version);
  to.put(std::uint8_t{0});
  to.put(hello.session_id);
  to.put(hello.max_stripes);
  to.put(hello.max_points_per_stripe);
  to.put(hello.field_x_mm);
  to.put(hello.field_y_mm);
  to.put(hello.depth_mm);
  to.put(hello.exposure_us);
  to.put(hello.processing_us);
  to.bytes(std::as_bytes(std::span{hello.sensor}));
  return message.finish();
}

std::size_t encode(std::uint32_t request_id, const Config& config, std::span<std::byte> out) noexcept {
  Message message{Type::config, request_id, out};
  auto& to = message.payload();
  to.put(static_cast<std::uint16_t>(config.status));
  to.put(static_cast<std::uint8_t>(config.encoding));
  to.put(static_cast<std::uint8_t>(config.intensity));
  to.put(config.stripes);
  to.put(config.points_per_stripe);
  return message.finish();
}

std::size_t encode(std::uint32_t request_id, const Trigger& trigger, std::span<std::byte> out) noexcept {
  Message message{Type::trigger, request_id, out};
  message.payload().put(trigger.shot_id);
  return message.finish();
}

std::size_t encode(std::uint32_t request_id, const Exposed& exposed, std::uint64_t acquired_ns,
                   std::span<std::byte> out) noexcept {
  Message message{Type::exposed, request_id, out};
  auto& to = message.payload();
  to.put(exposed.shot_id);
  to.put(exposed.session_id);
  to.put(static_cast<std::uint32_t>(exposed.repeated));
  return message.finish(acquired_ns);
}

std::size_t encode(std::uint32_t request_id, const StatusReply& status, std::span<std::byte> out) noexcept {
  Message message{Type::status, request_id, out};
  auto& to = message.payload();
  to.put(static_cast<std::uint16_t>(status.status));
  to.put(std::uint16_t{0});
  to.put(status.session_id);
  to.put(status.last_shot_id);
  to.put(status.temperature_c);
  return message.finish();
}

std::size_t encode(std::uint32_t request_id, const ErrorReply& error, std::span<std::byte> out) noexcept {
  Message message{Type::error, request_id, out};
  const std::string_view text = error.text;
  auto& to = message.payload();
  to.put(static_cast<std::uint16_t>(error.status));
  to.put(static_cast<std::uint16_t>(text.size()));
  to.put(error.shot_id);
  to.bytes(std::as_bytes(std::span{text}));
  return message.finish();
}

std::size_t encode_empty(std::uint32_t request_id, Type type, std::span<std::byte> out) noexcept {
  return Message{type, request_id, out}.finish();
}

// ---- decoders

std::expected<HelloRequest, Flaw> decode_hello_request(std::span<const std::byte> payload) noexcept {
  ByteReader from{payload};
  HelloRequest hello;
  hello.version_min = from.get<std::uint8_t>();
  hello.version_max = from.get<std::uint8_t>();
  return checked(hello, payload.size(), 4, hello.version_min <= hello.version_max);
}

std::expected<HelloReply, Flaw> decode_hello_reply(std::span<const std::byte> payload) noexcept {
  constexpr std::size_t size = 48;
  if (payload.size() != size) return std::unexpected{Flaw::payload_size};
  ByteReader from{payload};
  HelloReply hello;
  hello.status = static_cast<Status>(from.get<std::uint16_t>());
  hello.version = from.get<std::uint8_t>();
  from.get<std::uint8_t>();
  hello.session_id = from.get<std::uint32_t>();
  hello.max_stripes = from.get<std::uint16_t>();
  hello.max_points_per_stripe = from.get<std::uint16_t>();
  hello.field_x_mm = from.get<float>();
  hello.field_y_mm = from.get<float>();
  hello.depth_mm = from.get<float>();
  hello.exposure_us = from.get<std::uint32_t>();
  hello.processing_us = from.get<std::uint32_t>();
  const auto name = from.take(hello.sensor.size());
  std::ranges::transform(name, hello.sensor.begin(), [](std::byte c) { return static_cast<char>(c); });
  return checked(hello, payload.size(), size, known(hello.status));
}

std::expected<Config, Flaw> decode_config(std::span<const std::byte> payload) noexcept {
  ByteReader from{payload};
  Config config;
  config.status = static_cast<Status>(from.get<std::uint16_t>());
  const auto encoding = from.get<std::uint8_t>();
  const auto intensity = from.get<std::uint8_t>();
  config.encoding = static_cast<Encoding>(encoding);
  config.intensity = intensity != 0;
  config.stripes = from.get<std::uint16_t>();
  config.points_per_stripe = from.get<std::uint16_t>();
  return checked(config, payload.size(), 8, known(config.status) && encoding <= 1 && intensity <= 1);
}

std::expected<Trigger, Flaw> decode_trigger(std::span<const std::byte> payload) noexcept {
  ByteReader from{payload};
  const Trigger trigger{.shot_id = from.get<std::uint32_t>()};
  return checked(trigger, payload.size(), 4, true);
}

std::expected<Exposed, Flaw> decode_exposed(std::span<const std::byte> payload) noexcept {
  ByteReader from{payload};
  Exposed exposed;
  exposed.shot_id = from.get<std::uint32_t>();
  exposed.session_id = from.get<std::uint32_t>();
  const auto repeated = from.get<std::uint32_t>();
  exposed.repeated = repeated != 0;
  return checked(exposed, payload.size(), 12, repeated <= 1);
}

std::expected<StatusReply, Flaw> decode_status(std::span<const std::byte> payload) noexcept {
  ByteReader from{payload};
  StatusReply status;
  status.status = static_cast<Status>(from.get<std::uint16_t>());
  from.get<std::uint16_t>();
  status.session_id = from.get<std::uint32_t>();
  status.last_shot_id = from.get<std::uint32_t>();
  status.temperature_c = from.get<float>();
  return checked(status, payload.size(), 16, known(status.status));
}

std::expected<ErrorReply, Flaw> decode_error(std::span<const std::byte> payload) noexcept {
  ByteReader from{payload};
  ErrorReply error;
  error.status = static_cast<Status>(from.get<std::uint16_t>());
  const std::size_t length = from.get<std::uint16_t>();
  error.shot_id = from.get<std::uint32_t>();
  const auto text = from.take(length);
  error.text = printable_text<100>({reinterpret_cast<const char*>(text.data()), text.size()});
  return checked(error, payload.size(), 8 + length, known(error.status) && length <= 100);
}

}  // namespace moldloft::hal::psc1
