// Reads a recording with the libraries by which Foxglove reads files, message by message, and holds it against the schemas that Foxglove publishes.
//   node scripts/foxglove/recording.mjs FILE.mcap
// Protobuf: each schema in the file has the fields (name, number, type, repetition) of @foxglove/schemas, and each message, read by the
// published schema alone, has only values of the field's type, every field of its kind set, and gives the same bytes when written again.
// CDR: each definition in the file is the one of ROS 2 Humble that Foxglove publishes, and each message, read by it, gives the same bytes
// when written again. All packages are MIT or BSD-3-Clause.
import assert from 'node:assert/strict';
import { open } from 'node:fs/promises';
import { createRequire } from 'node:module';

// All of them are CommonJS.
const require = createRequire(import.meta.url);
const { McapIndexedReader } = require('@mcap/core');
const { FileHandleReadable } = require('@mcap/nodejs');
const { loadDecompressHandlers, protobufFromBinaryDescriptor } = require('@mcap/support');
const { foxgloveEnumSchemas, foxgloveMessageSchemas, generateProto } = require('@foxglove/schemas/internal');
const { parse } = require('@foxglove/rosmsg');
const { ros2humble } = require('@foxglove/rosmsg-msgs-common');
const { MessageReader, MessageWriter } = require('@foxglove/rosmsg2-serialization');
const protobuf = require('protobufjs');

// All messages that Foxglove publishes, by the text of their .proto files.
const published = new protobuf.Root();
for (const schema of Object.values(foxgloveMessageSchemas)) {
  // Enumerations stand in the message that they belong to.
  const enums = Object.values(foxgloveEnumSchemas).filter((e) => e.parentSchemaName === schema.name);
  protobuf.parse(generateProto(schema, enums), published, { keepCase: true });
}
published.addJSON(protobuf.common.get('google/protobuf/timestamp.proto').nested);
published.addJSON(protobuf.common.get('google/protobuf/duration.proto').nested);
published.resolveAll();

const full = (name) => name.replace(/^\./, '');
const type = (field) => (field.resolvedType ? full(field.resolvedType.fullName) : field.type);

// The file's type has exactly the fields of the published one, and so have those within it.
function sameFields(own, known, seen = new Set()) {
  if (seen.has(known.fullName)) return;
  seen.add(known.fullName);
  const list = (message) => message.fieldsArray.map((f) => [f.id, f.name, type(f), f.repeated]).sort((a, b) => a[0] - b[0]);
  assert.deepEqual(list(own), list(known), known.fullName);
  for (const field of known.fieldsArray) {
    const other = own.fieldsById[field.id].resolvedType;
    if (field.resolvedType instanceof protobuf.Enum) assert.deepEqual({ ...other.values }, { ...field.resolvedType.values }, field.fullName);
    else if (field.resolvedType) sameFields(other, field.resolvedType, seen);
  }
}

// Messages that need not be there: no filling of lines.
const OPTIONAL = ['.foxglove.PointsAnnotation.fill_color'];

// Values of a message are of their field's type; parts that are messages are there. Numbers are finite.
function check(value, field) {
  if (field.resolvedType instanceof protobuf.Enum) assert.ok(value in field.resolvedType.valuesById, field.fullName);
  else if (field.resolvedType) {
    if (value == null && OPTIONAL.includes(field.fullName)) return;
    assert.ok(value, `${field.fullName} is missing`);
    checkMessage(value, field.resolvedType);
  } else if (field.type === 'string') assert.equal(typeof value, 'string', field.fullName);
  else if (field.type === 'bytes') assert.ok(value instanceof Uint8Array, field.fullName);
  else if (field.type === 'bool') assert.equal(typeof value, 'boolean', field.fullName);
  else assert.ok(Number.isFinite(Number(value)), field.fullName);
}

function checkMessage(message, kind) {
  for (const field of kind.fieldsArray) {
    if (field.repeated) message[field.name].forEach((value) => check(value, field.resolve()));
    else check(message[field.name], field);
  }
}

const plain = (value) => JSON.parse(JSON.stringify(value));

// How a channel's messages are read and written again.
function codec(schema, channel) {
  if (channel.messageEncoding === 'protobuf') {
    const own = protobufFromBinaryDescriptor(schema.data);
    own.resolveAll();
    const kind = published.lookupType(schema.name);
    sameFields(own.lookupType(schema.name), kind);
    return (bytes) => {
      const message = kind.decode(bytes);
      checkMessage(message, kind);
      return kind.encode(message).finish();
    };
  }
  if (channel.messageEncoding === 'cdr') {
    const definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
    for (const definition of definitions) {
      // The first one of a text has no name of its own.
      const known = ros2humble[(definition.name ?? schema.name).replace('/msg/', '/')];
      assert.deepEqual(plain(definition.definitions), plain(known.definitions), known.name);
    }
    const [reader, writer] = [new MessageReader(definitions), new MessageWriter(definitions)];
    return (bytes) => writer.writeMessage(reader.readMessage(bytes));
  }
  assert.deepEqual([channel.messageEncoding, schema.encoding], ['json', 'jsonschema']);
  const known = JSON.parse(new TextDecoder().decode(schema.data)).properties;
  return (bytes) => {
    const row = JSON.parse(new TextDecoder().decode(bytes));
    for (const [name, value] of Object.entries(row)) {
      assert.ok(known[name].type.includes(value === null ? 'null' : typeof value), name);
    }
    return bytes;
  };
}

const path = process.argv[2];
const file = await open(path, 'r');
const reader = await McapIndexedReader.Initialize({
  readable: new FileHandleReadable(file),
  decompressHandlers: await loadDecompressHandlers(),
});
const codecs = new Map([...reader.channelsById.values()].map((c) => [c.id, codec(reader.schemasById.get(c.schemaId), c)]));
let messages = 0;
for await (const message of reader.readMessages()) {
  const { topic } = reader.channelsById.get(message.channelId);
  const again = codecs.get(message.channelId)(message.data);
  assert.ok(Buffer.from(again).equals(Buffer.from(message.data)), `${topic}: ${again.length} bytes of ${message.data.length} when written again`);
  messages += 1;
}
assert.equal(BigInt(messages), reader.statistics.messageCount);
await file.close();
console.log(`${path.split('/').pop()}: ${messages} messages on ${codecs.size} topics as Foxglove reads them, all as its schemas say`);
